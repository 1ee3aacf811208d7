#include "bench/thesis.hpp"

#include <fmt/core.h>

namespace moldloft::bench {

Json run_thesis(const Options& options) {
  if (!options.quiet) {
    fmt::print(
        "Ko, Laser Measurement and Reconstruction of Curved Plates (MIT, 2001), chapter 6, done again.\n");
    fmt::print("Published figures are the thesis's; \"literal\" is its program of six nested loops, here.\n");
  }
  Json result;
  result["wave"] = thesis_wave(options);
  const Json tables = thesis_bezier_tables(options);
  result["table_6_1"] = tables["table_6_1"];
  result["table_6_2"] = tables["table_6_2"];
  result["table_6_3"] = thesis_table_6_3(options);
  result["hood"] = thesis_hood(options);
  result["fuselage"] = thesis_fuselage(options);
  result["plate"] = thesis_plate(options);
  return result;
}

}  // namespace moldloft::bench
