#include "bench/occt_projection.hpp"

#ifdef MOLDLOFT_HAS_OCCT

#include "bench/stopwatch.hpp"

#include <Extrema_ExtPS.hxx>
#include <GeomAdaptor_Surface.hxx>
#include <Geom_BSplineSurface.hxx>
#include <ShapeAnalysis_Surface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array2OfPnt.hxx>

#include <algorithm>
#include <cmath>

namespace moldloft::bench {

namespace {

struct Knots {
  TColStd_Array1OfReal values;
  TColStd_Array1OfInteger counts;

  explicit Knots(const std::vector<double>& all) : values(1, distinct(all)), counts(1, distinct(all)) {
    int k = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (i == 0 || all[i] > all[i - 1]) values(++k) = all[i], counts(k) = 0;
      ++counts(k);
    }
  }
  static int distinct(const std::vector<double>& all) {
    return 1 + static_cast<int>(std::ranges::count_if(
                   all, [&](const double& knot) { return &knot != all.data() && knot > *(&knot - 1); }));
  }
};

}  // namespace

std::optional<OcctProjection> occt_projection(const geometry::BSplineSurface& s,
                                              std::span<const Eigen::Vector3d> points,
                                              std::span<const geometry::Parameters> guesses,
                                              std::span<const double> distances, int runs) {
  TColgp_Array2OfPnt poles(1, s.control_u(), 1, s.control_v());
  for (int i = 0; i < s.control_u(); ++i) {
    for (int j = 0; j < s.control_v(); ++j) poles(i + 1, j + 1) = gp_Pnt(s.x(i, j), s.y(i, j), s.z(i, j));
  }
  const Knots in_u(s.knots_u), in_v(s.knots_v);
  const Handle(Geom_BSplineSurface) surface =
      new Geom_BSplineSurface(poles, in_u.values, in_v.values, in_u.counts, in_v.counts, 3, 3);
  std::vector<gp_Pnt> asked;
  for (const Eigen::Vector3d& p : points) asked.emplace_back(p.x(), p.y(), p.z());

  OcctProjection result;
  const double count = static_cast<double>(points.size());
  ShapeAnalysis_Surface analysis(surface);
  result.next_us =
      1e6 / count *
      time_of(runs, [&] {
        for (std::size_t i = 0; i < asked.size(); ++i) {
          const gp_Pnt2d uv = analysis.NextValueOfUV(gp_Pnt2d(guesses[i].u, guesses[i].v), asked[i], 1e-9);
          keep(uv);
          result.next_off_mm =
              std::max(result.next_off_mm, surface->Value(uv.X(), uv.Y()).Distance(asked[i]) - distances[i]);
        }
      }).least;
  const GeomAdaptor_Surface adaptor(surface);
  Extrema_ExtPS extrema;
  extrema.SetFlag(Extrema_ExtFlag_MIN);
  extrema.SetAlgo(Extrema_ExtAlgo_Tree);
  extrema.Initialize(adaptor, 0, 1, 0, 1, 1e-10, 1e-10);
  result.extrema_us = 1e6 / count * time_of(std::max(1, runs / 4), [&] {
                                      for (std::size_t i = 0; i < asked.size(); ++i) {
                                        extrema.Perform(asked[i]);
                                        double least = 1e300;
                                        for (int k = 1; extrema.IsDone() && k <= extrema.NbExt(); ++k)
                                          least = std::min(least, extrema.SquareDistance(k));
                                        keep(least);
                                        // Where it finds none (beyond the border) there is nothing to compare.
                                        if (least < 1e300) {
                                          result.extrema_off_mm = std::max(result.extrema_off_mm,
                                                                           std::sqrt(least) - distances[i]);
                                        }
                                      }
                                    }).least;
  return result;
}

}  // namespace moldloft::bench

#else

namespace moldloft::bench {

std::optional<OcctProjection> occt_projection(const geometry::BSplineSurface&,
                                              std::span<const Eigen::Vector3d>,
                                              std::span<const geometry::Parameters>, std::span<const double>,
                                              int) {
  return std::nullopt;
}

}  // namespace moldloft::bench

#endif
