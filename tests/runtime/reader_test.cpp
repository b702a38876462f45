#include "runtime/reader.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <limits>
#include <thread>
#include <variant>

namespace hueline::runtime {
namespace {

using namespace std::chrono_literals;

/// Plays a script of packets and errors. Time moves on by 1 s with each step.
class Script : public PacketSource {
 public:
  struct OpenFails {};
  using Step = std::variant<Packet, ErrorCode>;
  Script(std::deque<bool> opens, std::deque<Step> steps, HostTime& now)
      : opens_(std::move(opens)), steps_(std::move(steps)), now_(now) {}
  Status open() override {
    const bool good = opens_.empty() || opens_.front();
    if (!opens_.empty()) opens_.pop_front();
    if (!good) return Error{ErrorCode::Unavailable, "no route"};
    return {};
  }
  Result<Packet> next(std::stop_token) override {
    now_ += 1s;
    if (steps_.empty()) return Error{ErrorCode::EndOfData, "end"};
    Step step = std::move(steps_.front());
    steps_.pop_front();
    if (auto* code = std::get_if<ErrorCode>(&step)) return Error{*code, "scripted"};
    return std::get<Packet>(std::move(step));
  }
  void close() override {}

 private:
  std::deque<bool> opens_;
  std::deque<Step> steps_;
  HostTime& now_;
};

std::vector<std::string> run(std::deque<bool> opens, std::deque<Script::Step> steps, bool is_recording = false,
                             bool is_good = true) {
  PacketQueue record({1000}), pipeline({1000});
  Ingest ingest({{}, {}}, record, pipeline, {1000});
  HostTime now{};
  Reader reader(1, "pos", std::make_unique<Script>(std::move(opens), std::move(steps), now),
                {1ms, 2ms, 3000ms, is_recording}, ingest, [&now] { return now; });
  reader.run({});
  EXPECT_EQ(reader.state(), Reader::State::Ended);
  EXPECT_EQ(reader.outcome().ok(), is_good);
  record.close();
  std::vector<std::string> said;
  while (auto packet = record.pop()) {
    EXPECT_EQ((*packet)->sensor, 1);
    if ((*packet)->kind == PacketKind::Wire)
      said.push_back("packet");
    else
      said.push_back(name(decode_fault(1, (*packet)->received, (*packet)->bytes.bytes())->kind));
  }
  return said;
}
using Said = std::vector<std::string>;

TEST(Reader, ReconnectsAfterThePullOfACable) {
  EXPECT_EQ(run({}, {Packet{}, ErrorCode::Disconnected, Packet{}}),
            (Said{"packet", "Disconnected", "Reconnected", "packet"}));
}

TEST(Reader, TellsOnceThatADeviceCannotBeReached) {
  EXPECT_EQ(run({false, false, false, true}, {Packet{}}), (Said{"Disconnected", "Reconnected", "packet"}));
}

TEST(Reader, TellsSilenceOnceAndItsEnd) {
  const auto quiet = ErrorCode::TimedOut;
  EXPECT_EQ(run({}, {Packet{}, quiet, quiet, quiet, quiet, quiet, quiet, Packet{}}),
            (Said{"packet", "Silent", "Reconnected", "packet"}));
}

TEST(Reader, EndsOnATruncatedRecordingWithAFault) {
  EXPECT_EQ(run({}, {Packet{}, ErrorCode::Truncated, Packet{}}), (Said{"packet", "Malformed"}));
}

TEST(Reader, StopEndsABackOff) {
  PacketQueue record({1000}), pipeline({1000});
  Ingest ingest({{}, {}}, record, pipeline, {1000});
  HostTime now{};
  Reader reader(1, "pos", std::make_unique<Script>(std::deque<bool>{false}, std::deque<Script::Step>{}, now),
                {1h, 1h, 3000ms}, ingest, [] { return HostTime{}; });
  std::jthread thread([&](std::stop_token stop) { reader.run(stop); });
  std::this_thread::sleep_for(20ms);
  thread.request_stop();
  thread.join();
  EXPECT_EQ(reader.state(), Reader::State::Ended);
}

/// Takes as long to connect as the test asks for, in steps.
class Slow : public PacketSource {
 public:
  Slow(int steps, int& closed) : steps_(steps), closed_(closed) {}
  Status open() override {
    if (steps_-- > 0) return Error{ErrorCode::TimedOut, {}};
    return {};
  }
  Result<Packet> next(std::stop_token) override { return Error{ErrorCode::EndOfData, "end"}; }
  void close() override { ++closed_; }

 private:
  int steps_;
  int& closed_;
};

TEST(Reader, ADeviceThatIsStillConnectingIsAskedOnAtOnceAndInSilence) {
  PacketQueue record({1000}), pipeline({1000});
  Ingest ingest({{}, {}}, record, pipeline, {1000});
  int closed = 0;
  Reader reader(1, "camera", std::make_unique<Slow>(1000, closed), {1h, 1h, 3000ms}, ingest, [] { return HostTime{}; });
  reader.run({});
  record.close();
  EXPECT_FALSE(record.pop().has_value()) << "a fault was told";
  EXPECT_GE(closed, 1);
}

TEST(Reader, AStopEndsAConnectionThatIsOnItsWay) {
  PacketQueue record({1000}), pipeline({1000});
  Ingest ingest({{}, {}}, record, pipeline, {1000});
  int closed = 0;
  Reader reader(1, "camera", std::make_unique<Slow>(std::numeric_limits<int>::max(), closed), {1h, 1h, 3000ms}, ingest,
                [] { return HostTime{}; });
  std::jthread thread([&](std::stop_token stop) { reader.run(stop); });
  std::this_thread::sleep_for(20ms);
  thread.request_stop();
  thread.join();
  EXPECT_EQ(closed, 1);
}

// A file that is opened again would start from its beginning, and its packets would be recorded twice.
TEST(Reader, ABrokenRecordingIsNotReadAgain) {
  const std::vector<std::string> expected{"packet", "Malformed"};
  EXPECT_EQ(run({}, {Packet{}, ErrorCode::Malformed, Packet{}}, true, false), expected);
  EXPECT_EQ(run({false, true}, {Packet{}}, true, false), std::vector<std::string>{"Disconnected"});
  EXPECT_EQ(run({}, {Packet{}}, true), std::vector<std::string>{"packet"});
}

}  // namespace
}  // namespace hueline::runtime
