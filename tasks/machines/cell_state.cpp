#include "tasks/machines/cell_state.hpp"

#include <array>

namespace moldloft::tasks {
namespace {

using S = CellState;
using E = CellEvent;
using A = CellAction;
constexpr auto any = hal::always<CellContext>;

// Held since the start, or in it: nothing is connected, nothing calibrated, nothing to go on with yet.
constexpr hal::Guard<CellContext> not_begun{
    "not begun", [](const CellContext& c) MOLDLOFT_NONBLOCKING { return !c.begun; }};

// clang-format off
constexpr CellTransition table[] = {
    // from         event           guard        action                     to
    {S::idle,        E::start,       any,         A::connect_and_calibrate,  S::starting},
    {S::idle,        E::start_held,  any,         A::wait_for_operator,      S::held},
    {S::starting,    E::done,        any,         A::measure,                S::execute},
    {S::execute,     E::done,        any,         A::flush_records,          S::completing},
    {S::completing,  E::done,        any,         A::none,                   S::complete},
    {S::complete,    E::reset,       any,         A::forget_run,             S::resetting},

    {S::starting,    E::hold,        any,         A::let_motion_end,         S::holding},
    {S::execute,     E::hold,        any,         A::let_motion_end,         S::holding},
    {S::holding,     E::done,        any,         A::none,                   S::held},
    {S::held,        E::unhold,      not_begun,   A::connect_and_calibrate,  S::starting},
    {S::held,        E::unhold,      any,         A::synchronise_again,      S::unholding},
    {S::unholding,   E::done,        any,         A::take_up_again,          S::execute},
    {S::unholding,   E::hold,        any,         A::let_motion_end,         S::holding},

    {S::idle,        E::stop,        any,         A::stop_motion,            S::stopping},
    {S::starting,    E::stop,        any,         A::stop_motion,            S::stopping},
    {S::execute,     E::stop,        any,         A::stop_motion,            S::stopping},
    {S::completing,  E::stop,        any,         A::stop_motion,            S::stopping},
    {S::complete,    E::stop,        any,         A::stop_motion,            S::stopping},
    {S::holding,     E::stop,        any,         A::stop_motion,            S::stopping},
    {S::held,        E::stop,        any,         A::stop_motion,            S::stopping},
    {S::unholding,   E::stop,        any,         A::stop_motion,            S::stopping},
    {S::resetting,   E::stop,        any,         A::stop_motion,            S::stopping},
    {S::stopping,    E::done,        any,         A::none,                   S::stopped},
    {S::stopped,     E::reset,       any,         A::forget_run,             S::resetting},
    {S::resetting,   E::done,        any,         A::none,                   S::idle},

    {S::idle,        E::abort,       any,         A::drop_everything,        S::aborting},
    {S::starting,    E::abort,       any,         A::drop_everything,        S::aborting},
    {S::execute,     E::abort,       any,         A::drop_everything,        S::aborting},
    {S::completing,  E::abort,       any,         A::drop_everything,        S::aborting},
    {S::complete,    E::abort,       any,         A::drop_everything,        S::aborting},
    {S::holding,     E::abort,       any,         A::drop_everything,        S::aborting},
    {S::held,        E::abort,       any,         A::drop_everything,        S::aborting},
    {S::unholding,   E::abort,       any,         A::drop_everything,        S::aborting},
    {S::stopping,    E::abort,       any,         A::drop_everything,        S::aborting},
    {S::stopped,     E::abort,       any,         A::drop_everything,        S::aborting},
    {S::clearing,    E::abort,       any,         A::drop_everything,        S::aborting},
    {S::resetting,   E::abort,       any,         A::drop_everything,        S::aborting},
    {S::aborting,    E::done,        any,         A::none,                   S::aborted},
    {S::aborted,     E::clear,       any,         A::synchronise_again,      S::clearing},
    {S::clearing,    E::done,        any,         A::none,                   S::stopped},
};

// Commands that a line controller may send at any time and that mean nothing just now.
constexpr hal::Ignored<S, E> ignored[] = {
    {S::idle, E::hold},       {S::idle, E::unhold},       {S::idle, E::clear},       {S::idle, E::reset},       {S::idle, E::done},
    {S::starting, E::start},  {S::starting, E::unhold},  {S::starting, E::clear},   {S::starting, E::reset},
    {S::execute, E::start},   {S::execute, E::unhold},    {S::execute, E::clear},    {S::execute, E::reset},
    {S::completing, E::start}, {S::completing, E::hold},  {S::completing, E::unhold}, {S::completing, E::clear}, {S::completing, E::reset},
    {S::complete, E::start},  {S::complete, E::hold},     {S::complete, E::unhold},  {S::complete, E::clear},   {S::complete, E::done},
    {S::holding, E::start},   {S::holding, E::hold},      {S::holding, E::unhold},   {S::holding, E::clear},    {S::holding, E::reset},
    {S::held, E::start},      {S::held, E::hold},         {S::held, E::clear},       {S::held, E::reset},       {S::held, E::done},
    {S::unholding, E::start}, {S::unholding, E::unhold},  {S::unholding, E::clear},  {S::unholding, E::reset},
    {S::stopping, E::start},  {S::stopping, E::hold},     {S::stopping, E::unhold},  {S::stopping, E::stop},    {S::stopping, E::clear},  {S::stopping, E::reset},
    {S::stopped, E::start},   {S::stopped, E::hold},      {S::stopped, E::unhold},   {S::stopped, E::stop},     {S::stopped, E::clear},   {S::stopped, E::done},
    {S::aborting, E::start},  {S::aborting, E::hold},     {S::aborting, E::unhold},  {S::aborting, E::stop},    {S::aborting, E::abort},  {S::aborting, E::clear}, {S::aborting, E::reset},
    {S::aborted, E::start},   {S::aborted, E::hold},      {S::aborted, E::unhold},   {S::aborted, E::stop},     {S::aborted, E::abort},   {S::aborted, E::reset},  {S::aborted, E::done},
    {S::clearing, E::start},  {S::clearing, E::hold},     {S::clearing, E::unhold},  {S::clearing, E::stop},    {S::clearing, E::clear},  {S::clearing, E::reset},
    {S::resetting, E::start}, {S::resetting, E::hold},    {S::resetting, E::unhold}, {S::resetting, E::clear},  {S::resetting, E::reset},
    // Only a process that has just been started starts held.
    {S::starting, E::start_held}, {S::execute, E::start_held}, {S::completing, E::start_held}, {S::complete, E::start_held}, {S::holding, E::start_held},
    {S::held, E::start_held}, {S::unholding, E::start_held}, {S::stopping, E::start_held}, {S::stopped, E::start_held}, {S::aborting, E::start_held},
    {S::aborted, E::start_held}, {S::clearing, E::start_held}, {S::resetting, E::start_held},
};

constexpr std::array<std::string_view, cell_state_count> state_names = {
    "Idle", "Starting", "Execute", "Completing", "Complete", "Holding", "Held", "Unholding",
    "Stopping", "Stopped", "Aborting", "Aborted", "Clearing", "Resetting"};
constexpr std::array<std::string_view, cell_event_count> event_names = {
    "start", "start held", "hold", "unhold", "stop", "abort", "clear", "reset", "done"};
constexpr std::array<std::string_view, 11> action_names = {
    "none", "connect and calibrate", "wait for operator", "measure", "flush records", "let motion end", "take up again", "stop motion",
    "drop everything", "synchronise again", "forget run"};
// clang-format on

}  // namespace

std::span<const CellTransition> cell_transitions() { return table; }
std::span<const hal::Ignored<CellState, CellEvent>> cell_ignored() { return ignored; }

std::string_view to_string(CellState s) { return state_names[static_cast<std::size_t>(s)]; }
std::string_view to_string(CellEvent e) { return event_names[static_cast<std::size_t>(e)]; }
std::string_view to_string(CellAction a) { return action_names[static_cast<std::size_t>(a)]; }

}  // namespace moldloft::tasks
