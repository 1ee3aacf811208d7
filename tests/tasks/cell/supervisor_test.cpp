#include "tasks/cell/supervisor.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace moldloft;
using namespace moldloft::tasks;
using namespace std::chrono_literals;

namespace {

struct Bench final : CellActions {
  void carry_out(CellAction action) override { actions.push_back(action); }
  void send(CellEvent event) {
    supervisor.command(event);
    supervisor.take_up_command();
  }
  void execute() {
    send(CellEvent::start);
    supervisor.done();
    REQUIRE(supervisor.state() == CellState::execute);
  }
  std::string next_notice() {
    const auto notice = supervisor.next_notice();
    return notice ? std::string{notice->text.view()} : "";
  }

  hal::Recorder recorder{{.bulk_bytes = 1u << 16, .events_bytes = 1u << 16, .largest_frame_bytes = 1u << 12}};
  std::vector<CellAction> actions;
  Supervisor supervisor{recorder, *this};
};

}  // namespace

TEST_CASE("of commands that come in one tick abort goes first, then stop, and none is lost") {
  Bench b;
  b.execute();
  b.supervisor.command(CellEvent::hold);
  b.supervisor.command(CellEvent::stop);
  b.supervisor.command(CellEvent::abort);
  b.supervisor.take_up_command();
  CHECK(b.supervisor.state() == CellState::aborting);
  CHECK(b.supervisor.why().view() == "aborted by command: clear when the cell is safe");
  b.supervisor.take_up_command();  // the stop: the table ignores it now
  b.supervisor.take_up_command();  // the hold
  b.supervisor.take_up_command();  // none is left
  CHECK(b.supervisor.state() == CellState::aborting);
  CHECK(b.actions ==
        std::vector{CellAction::connect_and_calibrate, CellAction::measure, CellAction::drop_everything});
}

TEST_CASE(
    "a hold that a device caused becomes a person's when that shows meanwhile, and never the other way") {
  Bench b;
  b.execute();
  b.supervisor.hold(HoldCause::scanner, "no answer");
  CHECK(b.supervisor.state() == CellState::holding);
  CHECK(b.next_notice() == "scanner: no answer");
  b.supervisor.hold(HoldCause::person, "look at the plate");
  CHECK(b.supervisor.cause() == HoldCause::person);
  CHECK(b.next_notice() == "look at the plate");
  b.supervisor.hold(HoldCause::scanner, "no answer");
  CHECK(b.supervisor.cause() == HoldCause::person);
  CHECK(b.supervisor.why().view() == "look at the plate");
  CHECK(b.next_notice() == "");
  CHECK(b.actions.back() == CellAction::let_motion_end);  // once
}

TEST_CASE("a cell that starts held says so, and forgets it when it is let go on") {
  Bench b;
  b.send(CellEvent::start_held);
  CHECK(b.supervisor.state() == CellState::held);
  CHECK(b.supervisor.why().view() == "started held: nothing moves before an operator sends unhold");
  b.send(CellEvent::unhold);
  CHECK(b.supervisor.state() == CellState::starting);
  CHECK(b.supervisor.cause() == HoldCause::none);
  CHECK(b.supervisor.why().view().empty());
}

TEST_CASE("the time in a state begins anew with each state") {
  Bench b;
  b.supervisor.begin_tick(3s);
  b.execute();
  b.supervisor.begin_tick(8s);
  CHECK(b.supervisor.in_state() == 5s);
  b.supervisor.hold(HoldCause::person, "stop here");
  CHECK(b.supervisor.in_state() == 0s);
}
