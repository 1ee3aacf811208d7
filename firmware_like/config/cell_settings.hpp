// What follows from the configuration for the cell and its background work: how many shots, edge points and spans the
// largest plate can need, and how large the scanner's frames are.
//
// Thread       any; pure
#pragma once

#include "firmware_like/config/config.hpp"
#include "hal/record/recorder.hpp"

namespace moldloft::firmware_like {

tasks::CellSettings cell_settings(const CellConfig&);
tasks::SurfaceTaskSettings surface_settings(const CellConfig&);

// Of the rings between control thread and disk.
hal::Recorder::Sizes recorder_sizes(const CellConfig&);

}  // namespace moldloft::firmware_like
