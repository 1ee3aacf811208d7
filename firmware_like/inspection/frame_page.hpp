// The frame-line page: one sheet of A4 that a person reads from 3 m beside the plate. Rows are frames, and each says in
// one number and two words what to do; below, the gaps at all pins as hairs, with their magnification written beside.
//
// Thread       any; pure
#pragma once

#include "firmware_like/inspection/inspection.hpp"

#include <string>

namespace moldloft::firmware_like {

std::string frame_page(const Inspection&);

// The hair diagram alone: frames one above the other, pins along them, gaps as hairs.
std::string hair_diagram(const std::vector<FrameLine>&, double width_px);

// "+3 bend more", "-2 too much", "good": in whole millimetres, as far as a person can bend.
struct FrameWords {
  std::string figure, words;
  int kind = 0;  // 0 good, 1 more, -1 too much, 2 not measured
};
FrameWords words_for(const FrameLine&);

}  // namespace moldloft::firmware_like
