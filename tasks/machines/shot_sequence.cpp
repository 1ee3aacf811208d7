#include "tasks/machines/shot_sequence.hpp"

#include <array>

namespace moldloft::tasks {
namespace {

using S = ShotState;
using E = ShotEvent;
using A = ShotAction;
constexpr auto any = hal::always<ShotContext>;

// clang-format off
constexpr ShotTransition table[] = {
    // from                  event        guard  action                    to
    {S::parked,              E::order,    any,   A::drive,                 S::driving},
    {S::driving,             E::arrived,  any,   A::note_pose,             S::in_place},
    {S::in_place,            E::clear,    any,   A::trigger,               S::exposing},
    {S::exposing,            E::exposed,  any,   A::release_arm,           S::computing},
    {S::exposing,            E::frame,    any,   A::release_and_deliver,   S::parked},
    {S::exposing,            E::failed,   any,   A::give_up,               S::in_place},

    {S::computing,           E::frame,    any,   A::deliver,               S::parked},
    {S::computing,           E::order,    any,   A::drive,                 S::driving_computing},
    {S::computing,           E::failed,   any,   A::give_up,               S::parked},
    {S::driving_computing,   E::frame,    any,   A::deliver,               S::driving},
    {S::driving_computing,   E::arrived,  any,   A::note_pose,             S::in_place_computing},
    {S::driving_computing,   E::failed,   any,   A::give_up,               S::driving},
    {S::in_place_computing,  E::frame,    any,   A::deliver,               S::in_place},
    {S::in_place_computing,  E::failed,   any,   A::give_up,               S::in_place},

    // The arm has moved by itself: it is sent to the same target once more, and what it may have seen counts for nothing.
    {S::in_place,            E::doubted,  any,   A::drive_again,           S::driving},
    {S::in_place_computing,  E::doubted,  any,   A::drive_again,           S::driving_computing},
    {S::exposing,            E::doubted,  any,   A::drop_and_drive_again,  S::driving},
    {S::computing,           E::doubted,  any,   A::drop_and_drive_again,  S::driving},
};

constexpr hal::Ignored<S, E> ignored[] = {
    {S::parked, E::arrived}, {S::parked, E::clear}, {S::parked, E::exposed}, {S::parked, E::frame}, {S::parked, E::failed},
    {S::driving, E::order}, {S::driving, E::clear}, {S::driving, E::exposed}, {S::driving, E::frame}, {S::driving, E::failed},
    {S::in_place, E::order}, {S::in_place, E::arrived}, {S::in_place, E::exposed}, {S::in_place, E::frame}, {S::in_place, E::failed},
    {S::exposing, E::order}, {S::exposing, E::arrived}, {S::exposing, E::clear},
    {S::computing, E::arrived}, {S::computing, E::clear}, {S::computing, E::exposed},
    {S::driving_computing, E::order}, {S::driving_computing, E::clear}, {S::driving_computing, E::exposed},
    {S::in_place_computing, E::order}, {S::in_place_computing, E::arrived}, {S::in_place_computing, E::clear}, {S::in_place_computing, E::exposed},
    {S::parked, E::doubted}, {S::driving, E::doubted}, {S::driving_computing, E::doubted},
};

constexpr std::array<std::string_view, shot_state_count> state_names = {
    "parked", "driving", "in place", "exposing", "computing", "driving, computing", "in place, computing"};
constexpr std::array<std::string_view, shot_event_count> event_names = {
    "order", "arrived", "clear", "exposed", "frame", "failed", "doubted"};
constexpr std::array<std::string_view, 10> action_names = {
    "none", "drive", "note pose", "trigger", "release arm", "deliver", "release and deliver", "give up",
    "drive again", "drop and drive again"};
// clang-format on

}  // namespace

std::span<const ShotTransition> shot_transitions() { return table; }
std::span<const hal::Ignored<ShotState, ShotEvent>> shot_ignored() { return ignored; }

std::string_view to_string(ShotState s) { return state_names[static_cast<std::size_t>(s)]; }
std::string_view to_string(ShotEvent e) { return event_names[static_cast<std::size_t>(e)]; }
std::string_view to_string(ShotAction a) { return action_names[static_cast<std::size_t>(a)]; }

}  // namespace moldloft::tasks
