// What follows from the configuration for the cell and its background work. The largest plate decides how
// many shots, edge points and spans can be needed; the scanner decides the size of its frames.
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
