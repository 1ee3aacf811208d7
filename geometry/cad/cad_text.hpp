// Numbers and strings as ISO 10303-21 and IGES 5.3 spell them.
//
// Accuracy     a number is written with the fewest digits that read back to the same bits (at most 17)
// Allocation   the string returned
// Failure      none: numbers are finite (assert), text that is not UTF-8 shows U+FFFD
#pragma once

#include <string>
#include <string_view>

namespace moldloft::geometry {

std::string step_real(double);  // "0.", "-12.5", "1.E-05": always with a point
std::string iges_real(double);  // the same with D for the exponent: a double-precision constant

// In quotes; ' and \ doubled; what is not printable ASCII stands as \X2\....\X0\ or as
// \X4\........\X0\ (ISO 10303-21, 6.4.3).
std::string step_string(std::string_view utf8);
// Hollerith: "5HPlate"; empty text is an empty field, what is not printable ASCII is '?'.
std::string iges_string(std::string_view utf8);

}  // namespace moldloft::geometry
