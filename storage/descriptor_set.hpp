#pragma once

#include <string>

namespace google::protobuf {
class Descriptor;
}

namespace hueline::storage {

/// Returns the serialised FileDescriptorSet of a message's .proto file and of everything that it imports, imports
/// first. MCAP and Foxglove expect this as schema data of the encoding "protobuf". Every run of one program returns the
/// same bytes.
std::string descriptor_set(const google::protobuf::Descriptor& message);

}  // namespace hueline::storage
