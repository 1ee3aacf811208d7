// The search for a surface's net: every net that may be taken is solved over the same points and scored, and one is
// chosen. The nets are the one given, or, nested in the finest, its halvings down to 4 x 4; their moments are merged
// from the next finer one's. One path for the cell, which steps in the slack of its ticks, and for fit_surface(), which
// steps until done.
//
// Model        net_solver.hpp; the choice net_choice.hpp
// Work         step() does about `budget` multiply-adds; how it is cut into steps changes coefficients not at all and
//              residuals in their last digits only
// Memory       what a net that shrank does not need is not touched
// Allocation   in the constructor; afterwards in also_try() only
// Failure      too_few_points with their number; empty_cells with the first such cell, where nothing fairs the surface
//              over it; singular with the control point; capacity and too_large as in net_solver.hpp
#pragma once

#include "geometry/error.hpp"
#include "geometry/fit/net_choice.hpp"
#include "geometry/fit/net_solver.hpp"

#include <expected>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct NetSearchSettings {
  bool nested = true;                                      // false: the finest net is the one to take
  double points_an_unknown = geometry::points_an_unknown;  // that a net must have to be tried
  NetCriterion criterion = NetCriterion::gcv;
  double tolerance = 0;
  bool shrinks = false;  // shrink_to() may be called
  bool norm = false;     // take the matrices' norms for an estimate of the condition
};

// One net over the points.
struct NetCandidate {
  SplineNet net;
  std::optional<MomentGrid> merged = {};  // nothing: the points' own cells
  std::vector<double> coefficients = {};  // relative to the moments' datum, by net.index(); once solved
  NetResult result = {};

  // The control points' heights above zero, [row u, column v].
  void heights_into(Eigen::MatrixXd& z, double datum) const;
};

class NetSearch {
 public:
  // Has room for all nets that `most_points` points let it try.
  NetSearch(SplineNet finest, const NetSearchSettings&,
            double most_points = std::numeric_limits<double>::infinity());

  // From now on the finest net has these spans, powers of two, no more of them than the constructor was told; its
  // longer direction may be the other one.
  void shrink_to(int spans_u, int spans_v);
  // A search over `points`, which has the finest net's cells, and must stay as it is, like the shots. The model's
  // net and moments are filled in for every candidate, its noise from the finest where it is not given.
  std::expected<void, Flaw> start(const MomentGrid& points, const NetTask& model, ShotOffsets* = nullptr);
  // True when all candidates are solved and one is chosen. `spent` of the budget was used before.
  std::expected<bool, Flaw> step(double budget, double spent = 0);
  std::expected<void, Flaw> finish();    // all steps that are left
  double work() const { return work_; }  // multiply-adds of the last step, with what was spent before it
  bool full() const { return full_; }    // it ended because its next piece had no room
  double progress() const;               // 0..1

  // After a search: one more net, over blocks of the points' cells that begin at `at_u`, `at_v`. Steps go on.
  void also_try(SplineNet net, std::span<const int> at_u, std::span<const int> at_v);
  // The candidate that was chosen once more, so that solver() holds its factor.
  void solve_again();

  // What was tried, from fine to coarse.
  std::span<const NetScore> scores() const { return std::span(scores_).subspan(first_, count_ - first_); }
  std::size_t chosen_score() const { return chosen_ - first_; }  // its place among them
  // The finest candidate is the first, tried or not.
  std::span<const NetCandidate> candidates() const { return std::span(candidates_).first(count_); }
  std::size_t chosen_place() const { return chosen_; }
  const NetCandidate& chosen() const { return candidates_[chosen_]; }
  const NetScore& score() const { return scores_[chosen_]; }  // of the chosen one
  const NetSolver& solver() const { return solver_; }
  std::size_t bytes() const;

 private:
  enum class Stage { merge, merge_shots, start, solve, score, done, failed };

  static std::vector<NetCandidate> candidates_of(SplineNet finest, bool nested);
  static NetSolver solver_for(std::span<const NetCandidate>, const NetSearchSettings&, double points);
  static bool determined(const NetCandidate&, const NetSearchSettings&, double points);
  const MomentGrid& grid(const NetCandidate& c) const { return c.merged ? *c.merged : *points_; }
  void search_in(std::size_t first, std::size_t end, Stage);
  std::expected<bool, Flaw> piece(double budget);
  std::unexpected<Flaw> fail(Error, std::size_t where);
  bool merge_some(double budget);
  bool merge_shots(double budget);
  std::expected<bool, Flaw> start_net();
  void take_score();

  NetSearchSettings settings_;
  std::vector<NetCandidate> candidates_;                  // from fine to coarse
  std::vector<NetScore> scores_;                          // of the candidates
  std::size_t count_ = 0;                                 // of the candidates that are in use
  std::vector<std::shared_ptr<const SpanTable>> tables_;  // of 4, 8, 16 and so on spans, where it shrinks
  NetSolver solver_;
  const MomentGrid* points_ = nullptr;
  ShotOffsets* shots_ = nullptr;
  NetTask model_;
  Stage stage_ = Stage::done;
  Flaw flaw_{};
  std::size_t first_ = 0, chosen_ = 0;  // first_: the finest that the points determine
  std::size_t at_ = 0, end_ = 0;        // the candidate at hand, and past the last to be solved
  int cell_ = 0, shot_ = 0;             // where merging is
  std::size_t shot_cell_ = 0, shot_cells_ = 0;
  double work_ = 0;
  bool full_ = false;
};

// The control point (row, column) of an unknown of a net.
std::pair<int, int> control_of(const SplineNet& net, int unknown);

}  // namespace moldloft::geometry
