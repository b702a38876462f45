#include "products/ply_file.hpp"

#include <fmt/format.h>

namespace hueline::products {
namespace {

const char* ply_name(storage::LasType type) {
  using storage::LasType;
  switch (type) {
    case LasType::U8:
      return "uchar";
    case LasType::I8:
      return "char";
    case LasType::U16:
      return "ushort";
    case LasType::I16:
      return "short";
    case LasType::U32:
      return "uint";
    case LasType::I32:
      return "int";
    case LasType::F32:
      return "float";
    case LasType::F64:
      return "double";
    case LasType::U64:
    case LasType::I64:
      break;
  }
  return nullptr;
}

}  // namespace

Result<PlyFile> PlyFile::create(const std::filesystem::path& path, const std::vector<std::string>& comments,
                                const std::vector<PlyProperty>& properties, std::uint64_t points) {
  std::string head = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : comments) head += "comment " + comment + '\n';
  head += fmt::format("element vertex {}\n", points);
  for (const PlyProperty& property : properties) {
    const char* type = ply_name(property.type);
    if (!type) return Error{ErrorCode::Invalid, property.name + ": PLY has no whole numbers of 64 bits"};
    head += fmt::format("property {} {}\n", type, property.name);
  }
  head += "end_header\n";
  auto file = storage::FileWriter::replace(path);
  if (!file) return file.error();
  PlyFile out(std::move(*file));
  if (Status written = out.file_.write(storage::as_bytes(head)); !written) return written.error();
  return out;
}

}  // namespace hueline::products
