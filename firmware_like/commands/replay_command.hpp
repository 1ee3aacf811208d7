// `moldloft replay`: what a stored run did. Its transitions and shots in order of time, or, with --timeline, the dumps
// of the flight recorder, tick by tick.
#pragma once

#include <string>

namespace moldloft::firmware_like {

struct ReplayOptions {
  std::string run;  // the run's folder, or one dump's file
  bool timeline = false;
  int ticks = 40;  // before the trigger
  bool all_ticks = false;
};
int replay_run(const ReplayOptions&);

}  // namespace moldloft::firmware_like
