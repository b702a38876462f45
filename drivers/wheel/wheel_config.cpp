#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "drivers/can/dbc.hpp"
#include "drivers/wheel/wheel_decoder.hpp"
#include "drivers/wheel/wheel_signal.hpp"

namespace hueline::drivers {
namespace {

/// The bits of a signal that no key has given yet. 0 bits are not allowed, so a file has to give the number.
WheelSignal unknown_bits() {
  WheelSignal out;
  out.bits = 0;
  return out;
}

/// A signal as rig files describe it: by its name in a database, by a line of a DBC file, or by single keys.
struct SignalKeys {
  std::string dbc;
  WheelSignal signal = unknown_bits();

  void visit(Keys& keys) {
    static const TextForm name{"MESSAGE.SIGNAL",
                               [](const std::string& text) {
                                 const std::size_t dot = text.find('.');
                                 return dot != 0 && dot != std::string::npos && dot + 1 < text.size();
                               },
                               "^[^.]+[.].+$"};
    keys.one_of({"signal", "dbc", "start_bit"});
    if (keys.text({"signal", "",
                   "The signal's name in the database of the sensor's key `dbc`, with that of its message, instead of "
                   "all keys below. Of a multiplexed signal the frames that have it are used.",
                   "none"},
                  signal.name, name)) {
      signal.bits = 8;  // until the database says it
      return;
    }
    if (keys.text({"dbc", "",
                   "A line of a DBC file, such as `SG_ NAME : 0\\|16@1+ (0.0075,0) [0\\|491.49] \"unit\" X`, instead "
                   "of all keys below.",
                   "none"},
                  dbc)) {
      if (const auto parsed = parse_dbc_signal(dbc); parsed.ok()) signal = WheelSignal(parsed->signal);
      return;
    }
    signal.visit(keys);
  }
  KeyError validate() const {
    if (dbc.empty()) return signal.validate();
    const auto parsed = parse_dbc_signal(dbc);
    if (!parsed.ok()) return {"dbc", "cannot be read: " + parsed.error().message};
    if (parsed->is_multiplexed)
      return {"dbc",
              "is a multiplexed signal, which is not in every frame of its message; allowed: one that is, or its name "
              "(`signal`) in "
              "a database"};
    const KeyError wrong = signal.validate();
    return {wrong.empty() ? "" : "dbc", wrong.empty() ? "" : "says that " + wrong.text()};
  }
};

struct SpeedKeys : SignalKeys {
  double metres_per_second = 1;

  void visit(Keys& keys) {
    keys.choice(required("unit", "", "The unit of the speed after `scale` and `offset`."), metres_per_second,
                {{"m/s", 1.0}, {"km/h", 1 / 3.6}, {"mph", 0.44704}});
    SignalKeys::visit(keys);
  }
  WheelSignal speed() const {
    WheelSignal out = signal;
    out.unit = metres_per_second;
    if (out.name.empty()) out.multiply(metres_per_second);
    return out;
  }
};

constexpr Range kMetresPerPulse{1e-6, 10};

struct PulseKeys : SignalKeys {
  double metres_per_pulse = 0;

  void visit(Keys& keys) {
    keys.number(required("metres_per_pulse", "m", "The circumference of the tyre divided by the pulses of one turn."),
                metres_per_pulse, kMetresPerPulse);
    SignalKeys::visit(keys);
  }
};

/// Checks what holds for signals that count, which have to be in every frame.
KeyError check_count(const WheelSignal& count, const char* what) {
  if (KeyError wrong = count.validate(); !wrong.empty()) return wrong;
  if (!count.selections.empty())
    return {"signal", fmt::format("is {}, which is multiplexed; allowed for {}: a signal that is in every frame",
                                  count.name, what)};
  if (count.number != CanNumber::Integer)
    return {"signal", fmt::format("is {}, a floating-point number; allowed for {}: a whole number", count.name, what)};
  if (count.bits > 32) return not_allowed("bits", std::to_string(count.bits), fmt::format("at most 32 for {}", what));
  if (count.is_signed) return {"signed", fmt::format("is true; allowed for {}: false, for they count up", what)};
  return {};
}

KeyError check_pulses(const WheelDecoder::Pulses& pulses) {
  if (KeyError wrong = check_count(pulses.signal, "pulses"); !wrong.empty()) return wrong;
  if (!kMetresPerPulse.has(pulses.metres_per_pulse))
    return not_allowed("metres_per_pulse", number_text(pulses.metres_per_pulse), kMetresPerPulse.allowed("m", false));
  if (pulses.signal.min != 0)
    return not_allowed("min", number_text(pulses.signal.min), "0 for pulses, which count up from there");
  if (counter_range(pulses.signal).count < 3)
    return not_allowed("max", number_text(pulses.signal.max), "2 or more for pulses");
  return {};
}

KeyError check_counter(const WheelSignal& counter) {
  if (KeyError wrong = check_count(counter, "a rolling counter"); !wrong.empty()) return wrong;
  if (counter_range(counter).count < 3)
    return not_allowed("bits", std::to_string(counter.bits),
                       "enough for the three values that a rolling counter has at least");
  return {};
}

struct MessageKeys {
  WheelDecoder::Message message;
  std::optional<std::uint32_t> id;

  void visit(Keys& keys) {
    keys.flag({"extended", "", "Whether `id` has 29 bits."}, message.is_extended);
    if (keys.whole({"id", "", "The message's id: 0 to 2047, or 29 bits.", "that of the message of the named signals"},
                   id, {0, 0x1FFFFFFF}))
      message.id = *id;
    std::vector<SpeedKeys> speeds;
    if (keys.list({"speeds", "", "Signals of wheels whose mean is the speed, each with its `unit`.", "none"}, speeds))
      for (const SpeedKeys& one : speeds) message.speeds.push_back(one.speed());
    std::vector<PulseKeys> pulses;
    if (keys.list({"pulses", "",
                   "Signals that count the pulses of wheels, each with its `metres_per_pulse`. A count starts again at "
                   "0 after its `max`, or where its bits end. Only one message of a sensor may have pulses.",
                   "none"},
                  pulses))
      for (const PulseKeys& one : pulses) message.pulses.push_back({one.signal, one.metres_per_pulse});
    std::optional<SignalKeys> counter;
    if (keys.section({"counter", "",
                      "A signal that grows by one from message to message, from its `min` to its `max` or to where its "
                      "bits end. Gaps cause fault Lost, and repeats fault Spurious.",
                      "none"},
                     counter))
      message.counter = counter->signal;
    keys.section(
        {"checksum", "",
         "The check sum over all bytes except the one that holds it. A wrong check sum causes fault Malformed.",
         "none"},
        message.checksum);
  }
  KeyError validate() const {
    const bool has_names = !message.names().empty();
    if (has_names && id)
      return not_allowed("id", std::to_string(*id), "none beside named signals, whose message has it");
    if (!has_names && !id) return {"id", "is missing; allowed: the message's id, or signals that name their message"};
    return message.validate();
  }
};

}  // namespace

void WheelDecoder::Checksum::visit(Keys& keys) {
  keys.choice(required("kind", "", "How the check sum is made."), kind,
              {{"xor", CanChecksum::Xor}, {"crc8_j1850", CanChecksum::Crc8J1850}, {"crc8_h2f", CanChecksum::Crc8H2f}});
  keys.whole(required("byte", "", "The position of the byte that holds the check sum; the first byte is 0."), byte,
             {0, 63});
}

std::vector<std::string> WheelDecoder::Message::names() const {
  std::vector<std::string> out;
  const auto add = [&](const WheelSignal& signal) {
    if (!signal.name.empty()) out.push_back(signal.name);
  };
  for (const WheelSignal& signal : speeds) add(signal);
  for (const Pulses& one : pulses) add(one.signal);
  if (counter) add(*counter);
  return out;
}

KeyError WheelDecoder::Message::validate() const {
  if (id > (is_extended ? 0x1FFFFFFFU : 0x7FFU))
    return not_allowed("id", std::to_string(id), is_extended ? "29 bits" : "0 to 2047 where extended is false");
  if (speeds.empty() && pulses.empty())
    return {"id", fmt::format("{} has neither speeds nor pulses; allowed: at least one of them", id)};
  for (std::size_t i = 0; i < speeds.size(); ++i)
    if (KeyError wrong = speeds[i].validate(); !wrong.empty()) return wrong.inside(fmt::format("speeds[{}]", i));
  for (std::size_t i = 0; i < pulses.size(); ++i)
    if (KeyError wrong = check_pulses(pulses[i]); !wrong.empty()) return wrong.inside(fmt::format("pulses[{}]", i));
  if (counter)
    if (KeyError wrong = check_counter(*counter); !wrong.empty()) return wrong.inside("counter");
  if (checksum)
    if (KeyError wrong = check_keys(*checksum); !wrong.empty()) return wrong.inside("checksum");
  return {};
}

void WheelDecoder::Config::visit(Keys& keys) {
  keys.text({"dbc", "",
             "The vehicle's database (a DBC file), in which `signal` finds bits, scale and range of signals by their "
             "names. The recording holds a copy, which a replay uses.",
             "none"},
            database);
  std::vector<MessageKeys> described;
  if (keys.list(required("messages", "", "The messages that have signals of the wheels."), described)) {
    messages.clear();
    for (MessageKeys& one : described) messages.push_back(std::move(one.message));
  }
  keys.number({"sigma_speed", "m/s", "One standard deviation of a speed."}, sigma_speed, {1e-4, 10});
  keys.number({"max_speed", "m/s", "A faster speed is fault Implausible."}, max_speed, {0.1, 200});
  keys.number({"max_acceleration", "m/s^2", "A larger change of the speed is fault Implausible."}, max_acceleration,
              {0.1, 1000});
}

KeyError WheelDecoder::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (messages.empty()) return not_allowed("messages", "an empty list", "one message or more");
  if (has_names() && database.empty())
    return {"dbc", "is missing, and signals are named; allowed: the DBC file that has them"};
  if (!has_names() && !database.empty())
    return not_allowed("dbc", database, "none where no signal is named (`signal`)");
  std::size_t counting = 0;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const Message& message = messages[i];
    const std::string place = fmt::format("messages[{}]", i);
    if (KeyError wrong = message.validate(); !wrong.empty()) return wrong.inside(place);
    for (std::size_t j = 0; j < i; ++j)
      if (message.names().empty() && messages[j].names().empty() && messages[j].id == message.id &&
          messages[j].is_extended == message.is_extended)
        return KeyError{"id", fmt::format("is {}, as in a message above; allowed: each id once", message.id)}.inside(
            place);
    if (!message.pulses.empty() && counting++ > 0)
      return KeyError{"pulses", "are in a message above already; allowed: pulses of one message alone"}.inside(place);
  }
  return {};
}

bool WheelDecoder::Config::has_names() const {
  return std::ranges::any_of(messages, [](const Message& message) { return !message.names().empty(); });
}

Result<std::vector<WheelDecoder::Message>> WheelDecoder::Config::find_signals(std::string_view dbc) const {
  const Dbc described = read_dbc(dbc);
  std::vector<Message> out = messages;
  for (std::size_t i = 0; i < out.size(); ++i) {
    Message& message = out[i];
    const DbcMessage* of = nullptr;
    Status status;
    const auto find = [&](WheelSignal& signal) {
      if (signal.name.empty() || !status.ok()) return;
      auto found = find_signal(described, signal);
      if (!found.ok()) {
        status = found.error();
      } else if (of && of != found->message) {
        status =
            Error{ErrorCode::Invalid, fmt::format("{} is not in {}, as the signals before; allowed: signals of one "
                                                  "message in each item of messages",
                                                  signal.name, of->name)};
      } else {
        of = found->message;
        signal = std::move(found->signal);
      }
    };
    for (WheelSignal& signal : message.speeds) find(signal);
    for (Pulses& one : message.pulses) find(one.signal);
    if (message.counter) find(*message.counter);
    if (!status.ok()) return status.error();
    if (of) {
      message.id = of->id;
      message.is_extended = of->is_extended;
    }
    KeyError wrong = message.validate();
    for (std::size_t j = 0; j < i && wrong.empty(); ++j)
      if (out[j].id == message.id && out[j].is_extended == message.is_extended)
        wrong = {"signal", fmt::format("is of message {}, as in an item above; allowed: each message once",
                                       of ? of->name : std::to_string(message.id))};
    if (!wrong.empty()) return Error{ErrorCode::Invalid, wrong.inside(fmt::format("messages[{}]", i)).text()};
  }
  return out;
}

}  // namespace hueline::drivers
