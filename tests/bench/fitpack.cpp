#include "bench/fitpack.hpp"

#include <fmt/core.h>
#include <fmt/os.h>

#include <cstdio>
#include <fstream>
#include <random>
#include <string>

namespace moldloft::bench {

namespace {

constexpr const char* script = R"(import sys, time
try:
    import numpy, scipy.interpolate
except ImportError:
    sys.exit(1)
folder, control = sys.argv[1], int(sys.argv[2])
x, y, z = numpy.fromfile(folder + '/points.f64').reshape(3, -1)
inner = numpy.linspace(0, float(sys.argv[3]), control - 2)[1:-1]
start = time.perf_counter()
side = float(sys.argv[3])
scipy.interpolate.LSQBivariateSpline(x, y, z, inner, inner, bbox=[0, side, 0, side])
print(time.perf_counter() - start)
)";

}  // namespace

Fitpack::Fitpack(const FitJob& job)
    : folder_(std::filesystem::temp_directory_path() /
              fmt::format("moldloft-bench-{:x}", std::random_device{}())) {
  std::filesystem::create_directories(folder_);
  std::ofstream points(folder_ / "points.f64", std::ios::binary);
  for (const auto* column : {&job.x, &job.y, &job.z}) {
    points.write(reinterpret_cast<const char*>(column->data()),
                 static_cast<std::streamsize>(column->size() * sizeof(double)));
  }
  std::ofstream(folder_ / "fit.py") << script;
}

Fitpack::~Fitpack() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::optional<double> Fitpack::seconds(int control) const {
  // The distribution's scipy belongs to the distribution's python, which need not be the first in the path.
  for (const char* python : {"python3", "/usr/bin/python3"}) {
    const std::string command = fmt::format("{} '{}/fit.py' '{}' {} {} 2>/dev/null", python, folder_.string(),
                                            folder_.string(), control, plate_mm);
    std::FILE* const child = popen(command.c_str(), "r");
    if (child == nullptr) continue;
    double seconds = 0;
    const int read = std::fscanf(child, "%lf", &seconds);
    if (pclose(child) == 0 && read == 1) return seconds;
  }
  return {};
}

}  // namespace moldloft::bench
