#pragma once

#include <optional>

#include "core/keys.hpp"
#include "drivers/stream/message_form.hpp"
#include "drivers/stream/second_labels.hpp"
#include "drivers/stream/stream_decoder.hpp"
#include "drivers/trajectory/sbet_solutions.hpp"

namespace hueline::drivers {

/// Records of an SBET in a stream that begins with the file. They have no mark, so those that are no multiple of 136
/// bytes from the beginning are not looked for.
class SbetForm final : public MessageForm {
 public:
  Judgement judge(std::span<const std::byte> rest, std::uint64_t position, bool is_boundary) override;
};

/// Decodes an SBET as the solutions of a POS.
///
///   what comes                              measurement
///   a record                                InsSolution, when the next one has come
///   the first record of a second            TimeLabel
///   bytes that are no record                Fault Malformed, with their number
///   records that never came                 Fault Lost, judged by their period
///   a record that is not later              counted, not used
///   no `week`                               Fault NoTime; times are those of the week 0
class SbetDecoder final : public StreamDecoder {
 public:
  /// How the heading is read, where the wander angle is not 0.
  enum class Heading : std::uint8_t { MinusWander, Platform, PlusWander };
  struct Config {
    std::optional<int> week;
    bool is_utc = false;
    Heading heading = Heading::MinusWander;
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit SbetDecoder(const Config& config);

 private:
  bool take(const Message& message) override;
  void finish() override;
  void forget() override;
  void give(std::optional<SbetSolutions::One> one, HostTime received);

  const Config config_;
  SbetSolutions solutions_;
  SecondLabels seconds_;
  std::optional<double> last_second_;
  HostTime received_{};  // of the latest record
  bool has_no_week_ = false;
};

}  // namespace hueline::drivers
