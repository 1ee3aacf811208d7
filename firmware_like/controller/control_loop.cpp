#include "firmware_like/controller/control_loop.hpp"

#include "hal/base/realtime_section.hpp"

namespace moldloft::firmware_like {

ThreadCounts run_to_rest(Controller& controller) {
  controller.start();
  bool goes_on = true;
  while (goes_on && controller.scheduler().ticks() < controller.scheduler().settings().warm_up_ticks)
    goes_on = controller.tick();

  ThreadCounter counter;
  hal::RealtimeSection::begin();
  while (goes_on) {
    counter.at_tick();
    goes_on = controller.tick();
  }
  hal::RealtimeSection::end();
  return counter.so_far();
}

}  // namespace moldloft::firmware_like
