#include "storage/descriptor_set.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <set>

namespace hueline::storage {
namespace {

void add(const google::protobuf::FileDescriptor& file, google::protobuf::FileDescriptorSet& out,
         std::set<std::string>& seen) {
  if (!seen.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add(*file.dependency(i), out, seen);
  file.CopyTo(out.add_file());
}

}  // namespace

std::string descriptor_set(const google::protobuf::Descriptor& message) {
  google::protobuf::FileDescriptorSet files;
  std::set<std::string> seen;
  add(*message.file(), files, seen);
  return files.SerializeAsString();
}

}  // namespace hueline::storage
