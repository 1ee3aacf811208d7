#include "tasks/machines/phases.hpp"

#include <array>

namespace moldloft::tasks {
namespace {

using P = Phase;
using E = PhaseEvent;
using A = PhaseAction;
constexpr auto any = hal::always<PhaseContext>;

constexpr hal::Guard<PhaseContext> beyond_plan{
    "beyond plan", [](const PhaseContext& c) MOLDLOFT_NONBLOCKING { return c.beyond_plan; }};

// clang-format off
constexpr PhaseTransition table[] = {
    // from               event              guard        action                      to
    {P::none,            E::begin,          any,          A::seek,                   P::seek_edge},
    {P::seek_edge,       E::edge_found,     any,          A::note_edge,              P::track_boundary},
    {P::track_boundary,  E::loop_closed,    any,          A::build_outline,          P::plan_scan},
    {P::plan_scan,       E::outline_ready,  any,          A::plan_zigzag,            P::plan_scan},
    {P::plan_scan,       E::zigzag_ready,   beyond_plan,  A::report_too_many_shots,  P::plan_scan},
    {P::plan_scan,       E::zigzag_ready,   any,          A::scan,                   P::scan_surface},
    {P::scan_surface,    E::all_taken,      any,          A::solve,                  P::finish_fit},
    {P::finish_fit,      E::surface_ready,  any,          A::finish,                 P::none},

    {P::plan_scan,       E::flaw,           beyond_plan,  A::report_too_large,       P::plan_scan},
    {P::plan_scan,       E::flaw,           any,          A::report_flaw,            P::plan_scan},
    {P::scan_surface,    E::flaw,           beyond_plan,  A::report_too_large,       P::scan_surface},
    {P::scan_surface,    E::flaw,           any,          A::report_flaw,            P::scan_surface},
    {P::finish_fit,      E::flaw,           beyond_plan,  A::report_too_large,       P::finish_fit},
    {P::finish_fit,      E::flaw,           any,          A::report_flaw,            P::finish_fit},

    {P::seek_edge,       E::forget,         any,          A::none,                   P::none},
    {P::track_boundary,  E::forget,         any,          A::none,                   P::none},
    {P::plan_scan,       E::forget,         any,          A::none,                   P::none},
    {P::scan_surface,    E::forget,         any,          A::none,                   P::none},
    {P::finish_fit,      E::forget,         any,          A::none,                   P::none},
};

constexpr hal::Ignored<P, E> ignored[] = {
    // A run that is over may leave a shot on its way, and background work that has failed.
    {P::none, E::edge_found}, {P::none, E::loop_closed}, {P::none, E::flaw}, {P::none, E::forget},
    // The background work begins when the boundary is closed.
    {P::seek_edge, E::flaw}, {P::track_boundary, E::flaw},
    // The tracker is on the edge with every shot that it takes of it.
    {P::track_boundary, E::edge_found},
    // Nobody but the phase itself waits for these.
    {P::seek_edge, E::begin}, {P::track_boundary, E::begin}, {P::plan_scan, E::begin}, {P::scan_surface, E::begin}, {P::finish_fit, E::begin},
    {P::plan_scan, E::edge_found}, {P::scan_surface, E::edge_found}, {P::finish_fit, E::edge_found},
    {P::seek_edge, E::loop_closed}, {P::plan_scan, E::loop_closed}, {P::scan_surface, E::loop_closed}, {P::finish_fit, E::loop_closed},
    {P::none, E::outline_ready}, {P::seek_edge, E::outline_ready}, {P::track_boundary, E::outline_ready}, {P::scan_surface, E::outline_ready}, {P::finish_fit, E::outline_ready},
    {P::none, E::zigzag_ready}, {P::seek_edge, E::zigzag_ready}, {P::track_boundary, E::zigzag_ready}, {P::scan_surface, E::zigzag_ready}, {P::finish_fit, E::zigzag_ready},
    {P::none, E::all_taken}, {P::seek_edge, E::all_taken}, {P::track_boundary, E::all_taken}, {P::plan_scan, E::all_taken}, {P::finish_fit, E::all_taken},
    {P::none, E::surface_ready}, {P::seek_edge, E::surface_ready}, {P::track_boundary, E::surface_ready}, {P::plan_scan, E::surface_ready}, {P::scan_surface, E::surface_ready},
};

constexpr std::array<std::string_view, phase_count> phase_names = {
    "", "SeekEdge", "TrackBoundary", "PlanScan", "ScanSurface", "FinishFit"};
constexpr std::array<std::string_view, phase_event_count> event_names = {
    "begin", "edge found", "loop closed", "outline ready", "zig-zag ready", "all taken", "surface ready", "flaw", "forget"};
constexpr std::array<std::string_view, 11> action_names = {
    "none", "seek", "note edge", "build outline", "plan zig-zag", "scan", "solve", "finish", "report too many shots",
    "report too large", "report flaw"};
// clang-format on

}  // namespace

std::span<const PhaseTransition> phase_transitions() { return table; }
std::span<const hal::Ignored<Phase, PhaseEvent>> phase_ignored() { return ignored; }

std::string_view to_string(Phase p) { return phase_names[static_cast<std::size_t>(p)]; }
std::string_view to_string(PhaseEvent e) { return event_names[static_cast<std::size_t>(e)]; }
std::string_view to_string(PhaseAction a) { return action_names[static_cast<std::size_t>(a)]; }

}  // namespace moldloft::tasks
