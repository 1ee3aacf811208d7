// The parts of `moldloft-bench thesis`: chapter 6 of Ko's thesis done again, each with its published
// figures beside ours.
#pragma once

#include "bench/benchmark.hpp"

namespace moldloft::bench {

Json thesis_wave(const Options&);           // section 6.2.1
Json thesis_bezier_tables(const Options&);  // {"table_6_1": ..., "table_6_2": ...}
Json thesis_table_6_3(const Options&);
Json thesis_hood(const Options&);      // section 6.3
Json thesis_fuselage(const Options&);  // section 6.4
Json thesis_plate(const Options&);     // section 6.4

Json run_thesis(const Options&);

}  // namespace moldloft::bench
