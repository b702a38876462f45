#include "drivers/sbet/sbet_decoder.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "core/calendar.hpp"

namespace hueline::drivers {
namespace {

std::vector<std::unique_ptr<MessageForm>> sbet_forms() {
  std::vector<std::unique_ptr<MessageForm>> out;
  out.push_back(std::make_unique<SbetForm>());
  return out;
}

std::array<double, kSbetDoubles> doubles_of(std::span<const std::byte> bytes) {
  std::array<double, kSbetDoubles> out{};
  std::memcpy(out.data(), bytes.data(), kSbetBytes);
  return out;
}

}  // namespace

Judgement SbetForm::judge(std::span<const std::byte> rest, std::uint64_t position, bool) {
  using Verdict = Judgement::Verdict;
  if (position % kSbetBytes != 0) return {};
  if (rest.size() < kSbetBytes) return {Verdict::NeedMore, 0};
  return impossible_sbet(doubles_of(rest)).empty() ? Judgement{Verdict::Whole, kSbetBytes}
                                                   : Judgement{Verdict::Broken, 0};
}

void SbetDecoder::Config::visit(Keys& keys) {
  keys.whole(
      {"week", "", "The GPS week in which the file begins: an SBET has the second of the week only.", "must be given"},
      week, {0, 10000});
  keys.choice({"times", "", "What the file's times are: seconds of the GPS week, or of the same week in UTC."}, is_utc,
              {{"gps", false}, {"utc", true}});
  keys.choice(
      {"heading", "",
       "How the heading is read: the platform heading minus the wander angle, as POSPac writes it, without it, or "
       "plus it."},
      heading,
      {{"minus_wander", Heading::MinusWander}, {"platform", Heading::Platform}, {"plus_wander", Heading::PlusWander}});
}

KeyError SbetDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (!week) return {"week", "is missing; allowed: the GPS week in which the file begins"};
  return {};
}

SbetDecoder::SbetDecoder(const Config& config)
    : StreamDecoder(sbet_forms()), config_(config), solutions_({config.week.value_or(0), config.is_utc, {}}) {}

bool SbetDecoder::take(const Message& message) {
  name("SBET record");
  SbetRecord record = sbet_record(doubles_of(message.bytes));
  record.second = continued_second(record.second, last_second_);
  fault_once(!config_.week, has_no_week_, FaultKind::NoTime, message.received,
             "an SBET has the second of the week only: `week` names the GPS week in which it begins");
  received_ = message.received;
  if (last_second_ && record.second <= *last_second_) return false;
  last_second_ = record.second;
  watch("SBET", from_gps_week(0, from_seconds(record.second)), message);
  give(solutions_.take(record), message.received);
  return true;
}

void SbetDecoder::give(std::optional<SbetSolutions::One> one, HostTime received) {
  if (!one) return;
  double& heading = one->solution.attitude.heading;
  heading = std::remainder(heading + one->wander * static_cast<double>(config_.heading), 2 * std::numbers::pi);
  if (heading < 0) heading += 2 * std::numbers::pi;
  if (auto second = seconds_.take(one->solution.time, {})) emit(*second, received);
  emit(std::move(one->solution), received);
}

void SbetDecoder::finish() { give(solutions_.finish(), received_); }

void SbetDecoder::forget() {
  seconds_.forget();
  last_second_.reset();
}

}  // namespace hueline::drivers
