// Is the result true? What was measured, held against what the configuration promises and against itself.
//
// A surface with a small residual can still be wrong: a shot that is missing, a plate that was pushed, a mount that is
// turned leave none. So the audit asks of every edge point, every planned shot and every part of the plate where it
// went, and of every shot whether it agrees with the others.
//
// Pure: RunResult in, findings out, the gravest first. Frame: world, mm. Cost: some 30 ms for a plate of 300 mm, on the
// caller's thread; not for the control thread.
#pragma once

#include "firmware_like/results/finding.hpp"
#include "firmware_like/results/run_result.hpp"

#include <vector>

namespace moldloft::firmware_like {

// Of a run that is complete; of any other there is nothing to say.
std::vector<Finding> audit(const RunResult&);

// Puts the findings into the result. With a warning a complete run is `warned`; a result that cannot be trusted is
// held, and its message says why.
void take_audit(RunResult&);

}  // namespace moldloft::firmware_like
