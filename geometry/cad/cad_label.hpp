// What a CAD file says about itself besides the shape. Everything comes from the caller: this room knows no
// clock, so the same face and label give the same bytes.
//
// Text is UTF-8. STEP keeps all of it; IGES has printable ASCII only and shows '?' for the rest.
#pragma once

#include <string>
#include <vector>

namespace moldloft::geometry {

struct CadStamp {  // UTC
  int year = 1970, month = 1, day = 1, hour = 0, minute = 0, second = 0;
};

struct CadLabel {
  std::string name = "plate";    // of the product
  std::string description = {};  // one line: what it is and how exact
  std::vector<std::string> notes =
      {};                      // further lines of that kind, each at most 256 characters (STEP's limit)
  std::string file_name = {};  // as the file is called, without its folder
  std::string system = "Moldloft";
  std::string author = {}, organization = {};
  CadStamp stamp = {};
  // How far edges, corners and surface may lie apart and still be one: the uncertainty that the file states,
  // and the bound on the space curves of trims. It says nothing of how well the plate was measured. The
  // default is the resolution of the common modelling kernels (1e-8 m).
  double closure_mm = 1e-5;
};

}  // namespace moldloft::geometry
