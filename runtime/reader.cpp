#include "runtime/reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace hueline::runtime {

Reader::Reader(SensorId sensor, std::string name, std::unique_ptr<PacketSource> source, Config config, Ingest& ingest,
               std::function<HostTime()> host_now)
    : sensor_(sensor),
      name_(std::move(name)),
      source_(std::move(source)),
      config_(config),
      ingest_(ingest),
      host_now_(std::move(host_now)) {}

void Reader::fault(FaultKind kind, std::string detail) {
  ingest_.submit(Fault{sensor_, kind, host_now_(), 1, std::move(detail)});
}

void Reader::run(std::stop_token stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  auto back_off = config_.first_back_off;
  bool had_opened = false, told_down = false;
  while (!stop.stop_requested()) {
    state_ = State::Connecting;
    const Status opened = source_->open();
    if (opened.ok()) {
      if (told_down) fault(FaultKind::Reconnected, had_opened ? "open again" : "open");
      told_down = false;
      had_opened = true;
      state_ = State::Running;
      const HostTime since = host_now_();
      const bool again = read_until_trouble(stop);
      source_->close();
      if (!again) break;
      told_down = true;
      // A device that stayed for a while is tried again soon. A device that fails at once is tried ever less often.
      if (host_now_() - since > std::chrono::seconds(5)) back_off = config_.first_back_off;
    } else {
      const Error& error = opened.error();
      if (error.code == ErrorCode::TimedOut) continue;
      if (error.code == ErrorCode::Invalid || error.code == ErrorCode::Unsupported) {
        fault(FaultKind::WrongDevice, error.message);
        if (config_.is_recording) outcome_ = error;
        break;
      }
      if (config_.is_recording && !take_error(error)) break;
      if (!told_down) fault(FaultKind::Disconnected, error.message);
      told_down = true;
    }
    std::unique_lock lock(mutex);
    wake.wait_for(lock, stop, back_off, [] { return false; });
    back_off = std::min(back_off * 2, config_.longest_back_off);
  }
  source_->close();  // also a source that is still opening or was never open, because others may wait for its closing
  state_ = State::Ended;
}

bool Reader::read_until_trouble(std::stop_token stop) {
  HostTime heard = host_now_();
  bool told_silent = false;
  while (!stop.stop_requested()) {
    Result<Packet> packet = source_->next(stop);
    if (packet.ok()) {
      heard = host_now_();
      if (told_silent) {
        fault(FaultKind::Reconnected, "speaks again");
        told_silent = false;
        state_ = State::Running;
      }
      packet->sensor = sensor_;
      if (config_.pixel_rows && packet->kind == PacketKind::Wire)
        packet->rows = config_.pixel_rows(packet->bytes.bytes());
      if (!config_.is_recording) {
        ingest_.submit(std::move(*packet), heard);
        continue;
      }
      if (!ingest_.wait_for_room(stop)) return false;
      ingest_.submit(std::move(*packet));
      continue;
    }
    const Error& error = packet.error();
    if (error.code == ErrorCode::TimedOut) {
      // A file waits for other files, not for a device, so it is never Silent.
      if (!config_.is_recording && !told_silent && host_now_() - heard > config_.silent_after) {
        fault(FaultKind::Silent,
              fmt::format("connected, but nothing came for {:.1f} s", to_seconds(host_now_() - heard)));
        told_silent = true;
        state_ = State::Silent;
      }
    } else if (error.code != ErrorCode::Exhausted) {
      return take_error(error);
    } else {
      fault(FaultKind::Overflow, error.message);
    }
  }
  return false;
}

bool Reader::take_error(const Error& error) {
  if (error.code == ErrorCode::Stopped || error.code == ErrorCode::EndOfData) return false;
  const bool is_malformed = error.code == ErrorCode::Malformed || error.code == ErrorCode::Truncated;
  fault(is_malformed ? FaultKind::Malformed : FaultKind::Disconnected, error.message);
  if (config_.is_recording) outcome_ = error;
  return !config_.is_recording && error.code != ErrorCode::Truncated;
}

}  // namespace hueline::runtime
