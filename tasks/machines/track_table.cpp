#include "tasks/machines/boundary_tracker.hpp"

#include <array>

namespace moldloft::tasks {
namespace {

using S = TrackState;
using E = TrackEvent;
using A = TrackAction;
constexpr auto any = hal::always<TrackContext>;
constexpr hal::Guard<TrackContext> may_seek{
    "steps left", [](const TrackContext& c) MOLDLOFT_NONBLOCKING { return c.seek_steps < c.max_seek_steps; }};
constexpr hal::Guard<TrackContext> may_turn{
    "turns left", [](const TrackContext& c) MOLDLOFT_NONBLOCKING { return c.turns < c.max_turns; }};
constexpr hal::Guard<TrackContext> may_half{
    "half steps left",
    [](const TrackContext& c) MOLDLOFT_NONBLOCKING { return c.half_steps < c.max_half_steps; }};
constexpr hal::Guard<TrackContext> may_rise{
    "heights left", [](const TrackContext& c) MOLDLOFT_NONBLOCKING { return c.heights < c.max_heights; }};
constexpr hal::Guard<TrackContext> may_back{
    "steps back left", [](const TrackContext& c) MOLDLOFT_NONBLOCKING { return c.backs < c.max_backs; }};
constexpr hal::Guard<TrackContext> from_hole{
    "began at a hole", [](const TrackContext& c) MOLDLOFT_NONBLOCKING { return c.is_far_off && c.rounds == 0; }};

// clang-format off
constexpr TrackTransition table[] = {
    // from           event                  guard     action                to
    {S::seek_edge,    E::no_plate,           may_rise, A::change_height,     S::seek_edge},
    {S::seek_edge,    E::no_plate,           any,      A::report_off_plate,  S::failed},
    {S::seek_edge,    E::plate_fills_field,  may_seek, A::step_along_x,      S::seek_edge},
    {S::seek_edge,    E::plate_fills_field,  any,      A::report_no_edge,    S::failed},
    {S::seek_edge,    E::side,               any,      A::centre_on_edge,    S::first_side},
    {S::seek_edge,    E::corner,             any,      A::centre_on_edge,    S::first_side},
    {S::seek_edge,    E::hidden,             may_turn, A::turn,              S::seek_edge},
    {S::seek_edge,    E::hidden,             may_half, A::step_half_along_x, S::seek_edge},
    {S::seek_edge,    E::hidden,             any,      A::report_hidden,     S::failed},

    {S::first_side,   E::side,               any,      A::begin_outline,     S::track},
    {S::first_side,   E::corner,             any,      A::begin_outline,     S::track},
    {S::first_side,   E::hidden,             may_turn, A::turn,              S::first_side},
    {S::first_side,   E::hidden,             any,      A::report_hidden,     S::failed},
    {S::first_side,   E::no_plate,           any,      A::report_lost,       S::failed},
    {S::first_side,   E::plate_fills_field,  may_seek, A::look_past_hole,    S::seek_edge},  // it was a hole's
    {S::first_side,   E::plate_fills_field,  any,      A::report_no_edge,    S::failed},
    {S::first_side,   E::beyond_plan,        any,      A::report_too_large,  S::failed},

    {S::track,        E::side,               any,      A::advance,           S::track},
    {S::track,        E::corner,             any,      A::advance,           S::track},
    {S::track,        E::hidden,             may_turn, A::turn,              S::turn_head},
    {S::track,        E::hidden,             any,      A::report_hidden,     S::failed},
    {S::track,        E::loop_closed,        any,      A::finish,            S::closed},
    {S::track,        E::passes_beside,      from_hole, A::begin_again,      S::track},
    {S::track,        E::passes_beside,      any,      A::report_open,       S::failed},
    {S::track,        E::hole_closed,        may_seek, A::leave_hole,        S::seek_edge},
    {S::track,        E::hole_closed,        any,      A::report_no_edge,    S::failed},
    {S::track,        E::no_plate,           may_back, A::back_up,           S::step_back},
    {S::track,        E::no_plate,           any,      A::report_lost,       S::failed},
    {S::track,        E::plate_fills_field,  may_back, A::back_up,           S::step_back},
    {S::track,        E::plate_fills_field,  any,      A::report_lost,       S::failed},
    {S::track,        E::beyond_plan,        any,      A::report_too_large,  S::failed},

    {S::turn_head,    E::side,               any,      A::advance,           S::track},
    {S::turn_head,    E::corner,             any,      A::advance,           S::track},
    {S::turn_head,    E::loop_closed,        any,      A::finish,            S::closed},
    {S::turn_head,    E::passes_beside,      from_hole, A::begin_again,      S::track},
    {S::turn_head,    E::passes_beside,      any,      A::report_open,       S::failed},
    {S::turn_head,    E::hole_closed,        may_seek, A::leave_hole,        S::seek_edge},
    {S::turn_head,    E::hole_closed,        any,      A::report_no_edge,    S::failed},
    {S::turn_head,    E::hidden,             may_turn, A::turn,              S::turn_head},
    {S::turn_head,    E::hidden,             any,      A::report_hidden,     S::failed},
    {S::turn_head,    E::no_plate,           any,      A::report_lost,       S::failed},
    {S::turn_head,    E::plate_fills_field,  any,      A::report_lost,       S::failed},
    {S::turn_head,    E::beyond_plan,        any,      A::report_too_large,  S::failed},

    {S::step_back,    E::side,               any,      A::advance,           S::track},
    {S::step_back,    E::corner,             any,      A::advance,           S::track},
    {S::step_back,    E::loop_closed,        any,      A::finish,            S::closed},
    {S::step_back,    E::passes_beside,      from_hole, A::begin_again,      S::track},
    {S::step_back,    E::passes_beside,      any,      A::report_open,       S::failed},
    {S::step_back,    E::hole_closed,        may_seek, A::leave_hole,        S::seek_edge},
    {S::step_back,    E::hole_closed,        any,      A::report_no_edge,    S::failed},
    {S::step_back,    E::hidden,             may_turn, A::turn,              S::turn_head},
    {S::step_back,    E::hidden,             any,      A::report_hidden,     S::failed},
    {S::step_back,    E::no_plate,           may_back, A::back_up,           S::step_back},
    {S::step_back,    E::no_plate,           any,      A::report_lost,       S::failed},
    {S::step_back,    E::plate_fills_field,  may_back, A::back_up,           S::step_back},
    {S::step_back,    E::plate_fills_field,  any,      A::report_lost,       S::failed},
    {S::step_back,    E::beyond_plan,        any,      A::report_too_large,  S::failed},
};

constexpr hal::Ignored<S, E> ignored[] = {
    {S::seek_edge, E::loop_closed}, {S::first_side, E::loop_closed}, {S::seek_edge, E::passes_beside}, {S::seek_edge, E::hole_closed}, {S::first_side, E::passes_beside}, {S::first_side, E::hole_closed}, {S::seek_edge, E::beyond_plan},  // the outline has not begun
    {S::closed, E::no_plate}, {S::closed, E::plate_fills_field}, {S::closed, E::side}, {S::closed, E::corner}, {S::closed, E::hidden}, {S::closed, E::loop_closed}, {S::closed, E::passes_beside}, {S::closed, E::hole_closed}, {S::closed, E::beyond_plan},
    {S::failed, E::no_plate}, {S::failed, E::plate_fills_field}, {S::failed, E::side}, {S::failed, E::corner}, {S::failed, E::hidden}, {S::failed, E::loop_closed}, {S::failed, E::passes_beside}, {S::failed, E::hole_closed}, {S::failed, E::beyond_plan},
};

constexpr std::array<std::string_view, track_state_count> state_names = {
    "seek edge", "first side", "track", "turn head", "step back", "closed", "failed"};
constexpr std::array<std::string_view, track_event_count> event_names = {
    "no plate", "plate fills field", "side", "corner", "hidden", "loop closed", "passes beside", "hole closed", "beyond plan"};
constexpr std::array<std::string_view, 19> action_names = {
    "none", "step along x", "step half along x", "change height", "centre on edge", "begin outline", "look past hole", "leave hole", "begin again", "advance", "turn", "back up", "finish",
    "report off plate", "report no edge", "report lost", "report hidden", "report too large", "report open"};
// clang-format on

}  // namespace

std::span<const TrackTransition> track_transitions() { return table; }
std::span<const hal::Ignored<TrackState, TrackEvent>> track_ignored() { return ignored; }

std::string_view to_string(TrackState s) { return state_names[static_cast<std::size_t>(s)]; }
std::string_view to_string(TrackEvent e) { return event_names[static_cast<std::size_t>(e)]; }
std::string_view to_string(TrackAction a) { return action_names[static_cast<std::size_t>(a)]; }

}  // namespace moldloft::tasks
