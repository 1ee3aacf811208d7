// FITPACK (Dierckx 1993) through python3 and scipy, if the machine has them: a child process reads the
// columns from a file and takes the time of its own call.
#pragma once

#include "bench/fit_job.hpp"

#include <filesystem>
#include <optional>

namespace moldloft::bench {

class Fitpack {
 public:
  explicit Fitpack(const FitJob&);  // writes the columns
  ~Fitpack();
  Fitpack(const Fitpack&) = delete;
  Fitpack& operator=(const Fitpack&) = delete;

  // Seconds of scipy.interpolate.LSQBivariateSpline on a control x control net; nothing where scipy
  // is not installed.
  std::optional<double> seconds(int control) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace moldloft::bench
