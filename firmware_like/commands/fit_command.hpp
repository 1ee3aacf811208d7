// `moldloft fit`: computes outline and surface again from the shots of a stored run. The value returned is
// the program's exit code (complaint.hpp).
#pragma once

#include <string>

namespace moldloft::firmware_like {

struct FitOptions {
  std::string run;     // a run's folder; read only
  std::string out;     // where the results go; must not be the run itself
  bool force = false;  // even over another run's results
};
int fit_run(const FitOptions&);

}  // namespace moldloft::firmware_like
