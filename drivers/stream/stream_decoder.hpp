#pragma once

#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/decoder.hpp"
#include "drivers/stream/cycle_watch.hpp"
#include "drivers/stream/message_framer.hpp"

namespace hueline::drivers {

/// The common part of decoders of byte streams: it splits the stream into messages, accounts for every byte, and
/// reports what was skipped and what never came. A decoder of a device only says what a message means.
class StreamDecoder : public Decoder, private MessageFramer::Sink {
 public:
  void decode(const Packet& packet, std::vector<Measurement>& out) final;
  void flush(std::vector<Measurement>& out) final;
  /// Counts the bytes that are held as malformed. Call flush() first to get the whole messages among them.
  void reset() final;
  const DecodeCounts& counts() const final { return counts_; }

 protected:
  /// A whole message. `form` is the index of its form in the list that the constructor was given.
  struct Message {
    std::size_t form = 0;
    std::span<const std::byte> bytes;
    HostTime received{};
  };

  explicit StreamDecoder(std::vector<std::unique_ptr<MessageForm>> forms) : framer_(std::move(forms)) {}

  /// Takes the next message of the stream. Returns whether it became, or will become, a measurement. It calls name()
  /// once.
  virtual bool take(const Message& message) = 0;
  /// Appends what was held back, because no more messages follow.
  virtual void finish() {}
  /// Forgets what belongs to the messages so far, because the stream was interrupted.
  virtual void forget() {}

  /// Counts the message that is being taken under its maker's name.
  void name(const std::string& message) { ++counts_.of(message); }
  /// Appends a measurement of this sensor that came at `received`.
  template <class T>
  void emit(T measurement, HostTime received) {
    measurement.sensor = sensor_;
    measurement.received = received;
    out_->emplace_back(std::move(measurement));
  }
  /// Appends a measurement of this sensor that has no arrival.
  template <class T>
  void emit(T measurement) {
    measurement.sensor = sensor_;
    out_->emplace_back(std::move(measurement));
  }
  /// Appends measurements whose `received` is set, as those of this sensor.
  void emit_all(std::vector<Measurement> made) {
    for (Measurement& measurement : made) {
      std::visit([&](auto& m) { m.sensor = sensor_; }, measurement);
      out_->push_back(std::move(measurement));
    }
  }
  /// Appends a fault.
  void fault(FaultKind kind, HostTime time, std::uint64_t count, std::string detail) {
    out_->emplace_back(Fault{sensor_, kind, time, count, std::move(detail)});
  }
  /// Appends a fault if `is_wrong` and the state `was_wrong` is not set, and stores `is_wrong` there: a lasting trouble
  /// is told when it begins.
  void fault_once(bool is_wrong, bool& was_wrong, FaultKind kind, HostTime time, const std::string& detail) {
    if (is_wrong && !was_wrong) fault(kind, time, 1, detail);
    was_wrong = is_wrong;
  }
  /// Follows a message that is sent at a fixed rate, so that missing ones are found.
  void watch(const std::string& name, GpsTime time, const Message& message) {
    watch_.take(name, time, message.bytes.size(), message.received);
  }

 private:
  void on_message(std::size_t form, std::span<const std::byte> message, HostTime received) final;
  void on_skipped(std::uint64_t bytes, std::uint64_t messages, HostTime received) final;

  MessageFramer framer_;
  CycleWatch watch_;
  DecodeCounts counts_;
  HostTime newest_{};  // arrival of the latest message
  SensorId sensor_ = kSystemSensor;
  std::vector<Measurement>* out_ = nullptr;  // where the current call puts measurements
};

}  // namespace hueline::drivers
