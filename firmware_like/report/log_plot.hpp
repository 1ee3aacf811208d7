// Histograms as an SVG drawing with both axes logarithmic: time to the right, how often upwards. One value among
// millions is seen as well as the crowd, which is the point of a latency histogram.
//
// The colours are the page's: series i is drawn with the CSS class "s<i>".
//
// Thread       any
// Allocation   yes
// Failure      none; a plot without values is empty axes
#pragma once

#include "hal/base/clock.hpp"
#include "tasks/scheduler/histogram.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

struct LogSeries {
  std::string name;
  tasks::Histogram values;
};

struct LogPlot {
  std::vector<LogSeries> series;
  std::string label;            // of the axis of time
  hal::Duration smallest{100};  // what is smaller stands in the first bar
  bool whole_us = false;  // bars begin and end at whole microseconds: for series that know nothing finer
  double width_px = 920, height_px = 330;  // labels are 12 px and as many as fit
};
std::string log_plot(const LogPlot&);

std::string time_text(hal::Duration);  // "870 ns", "23 us", "1.98 ms"

}  // namespace moldloft::firmware_like
