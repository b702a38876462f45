#pragma once

#include <string>

namespace google::protobuf {
class Descriptor;
}

namespace hueline::storage {

/// The serialised FileDescriptorSet of a message's .proto file and all that it imports, imports first: what MCAP and
/// Foxglove want as schema data of encoding "protobuf". The same for every run of a program.
std::string descriptor_set(const google::protobuf::Descriptor& message);

}  // namespace hueline::storage
