// Points to STEP: from a file of x y z lines (mm) to the surface through them, as CAD programs read it.
//
//     points_to_step IN.xyz OUT.step
#include "geometry/cad/step_writer.hpp"
#include "geometry/fit/fit_surface.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

using namespace moldloft::geometry;

int main(int count, char** words) {
  if (count != 3) return std::fprintf(stderr, "points_to_step IN.xyz OUT.step\n"), 2;
  std::vector<double> x, y, z;
  std::ifstream in{words[1]};
  for (std::string line; std::getline(in, line);) {
    double a = 0, b = 0, c = 0;
    if (std::sscanf(line.c_str(), "%lf %lf %lf", &a, &b, &c) != 3)
      return std::fprintf(stderr, "%s:%zu: not x y z: %s\n", words[1], x.size() + 1, line.c_str()), 1;
    x.push_back(a), y.push_back(b), z.push_back(c);
  }
  if (x.empty()) return std::fprintf(stderr, "%s: no points to be read\n", words[1]), 1;

  const auto [left, right] = std::ranges::minmax(x);
  const auto [near, far] = std::ranges::minmax(y);
  const auto fitted =
      fit_surface({.u = x, .v = y, .z = z}, {.domain = {left, right, near, far}, .tolerance = 0.005});
  if (!fitted)
    return std::fprintf(stderr, "%s: no surface: %s\n", words[1], to_string(fitted.error().error).data()), 1;
  const auto text = step_text({.surface = fitted->surface}, {.name = "plate", .file_name = "plate.step"});
  if (!text) return std::fprintf(stderr, "%s: no STEP: %s\n", words[1], to_string(text.error()).data()), 1;
  if (!(std::ofstream{words[2]} << *text << std::flush))
    return std::fprintf(stderr, "%s cannot be written\n", words[2]), 1;
  std::printf("%zu points, %d x %d control points, rms %.3g mm\n", x.size(), fitted->surface.control_u(),
              fitted->surface.control_v(), fitted->report.rms_residual);
}
