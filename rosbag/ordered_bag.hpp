#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "rosbag/bag.hpp"

namespace hueline::rosbag {

/// The time of a message by which it is sorted; nothing: it is not wanted.
using TimeOfMessage = std::function<std::optional<UnixTime>(const BagTopic&, const BagMessage&)>;

/// Reads a recording to its end and returns one that gives its messages in the order of `time_of`, as if the recorder
/// had taken them then; those of one time stay in the order of the file. Programs that convert recordings write one
/// topic behind the other, and recorders of one topic each make a file of each. The wanted messages are copied into the
/// file `copy`, which the caller removes afterwards; each takes 32 bytes of memory. Damage and the end of the recording
/// are told by the new one's next(), damage first. Errors: Io of the copy.
Result<std::unique_ptr<Bag>> in_order(Bag& bag, const std::filesystem::path& copy, const TimeOfMessage& time_of);

}  // namespace hueline::rosbag
