#include "products/e57_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>

#include "core/printable.hpp"
#include "storage/e57_pages.hpp"

namespace hueline::products {
namespace {

using storage::Bytes;
using storage::ByteView;

void append_checksum(Bytes& page) {
  const std::uint32_t sum = storage::e57_checksum(page);
  for (const int shift : {24, 16, 8, 0}) page.push_back(static_cast<std::byte>(sum >> shift));
}

/// XML 1.0 has no control characters, and what is not UTF-8 makes the whole description unreadable.
std::string xml_text(const std::string& text) {
  std::string kept;
  for (const char c : text)
    if (static_cast<unsigned char>(c) >= ' ' || c == '\n' || c == '\t') kept += c == '\t' ? ' ' : c;
  kept = printable(kept, LineEnds::Keep);
  return as_markup(kept);
}

std::string text_element(const char* name, const std::string& text) {
  return fmt::format("<{0} type=\"String\">{1}</{0}>\n", name, xml_text(text));
}

std::string number_element(const std::string& name, double value) {
  return fmt::format("<{0} type=\"Float\">{1:.17g}</{0}>\n", name, value);
}

std::string time_element(const char* name, double gps_s) {
  return fmt::format(
      "<{0} type=\"Structure\">\n{1}<isAtomicClockReferenced type=\"Integer\">1</isAtomicClockReferenced>\n</{0}>\n",
      name, number_element("dateTimeValue", gps_s));
}

}  // namespace

E57File::E57File(storage::FileWriter file, std::vector<E57Field> fields)
    : file_(std::move(file)), fields_(std::move(fields)), streams_(fields_.size()) {
  std::size_t size = 0;
  for (const E57Field& field : fields_) size += field.size();
  most_in_packet_ = (storage::kE57MostPacket - storage::kE57PacketHead - 2 * fields_.size() - 4) / size;
  digest_ = {0xcbf29ce484222325, 0x84222325cbf29ce4};  // FNV-1a, from two starts
}

Result<E57File> E57File::create(const std::filesystem::path& path, std::vector<E57Field> fields) {
  auto file = storage::FileWriter::replace(path);
  if (!file) return file.error();
  E57File out(std::move(*file), std::move(fields));
  // The heads are known at the end.
  if (Status begun = out.append(Bytes(storage::kE57FileHeader + storage::kE57SectionHeader)); !begun)
    return begun.error();
  return out;
}

Status E57File::write_page() {
  if (first_page_.empty()) first_page_ = page_;
  append_checksum(page_);
  Status written = file_.write(page_);
  page_.clear();
  return written;
}

Status E57File::append(ByteView bytes) {
  written_ += bytes.size();
  while (!bytes.empty()) {
    const std::size_t part = std::min(bytes.size(), storage::kE57Payload - page_.size());
    storage::append(page_, bytes.first(part));
    bytes = bytes.subspan(part);
    if (page_.size() < storage::kE57Payload) break;
    if (Status written = write_page(); !written) return written;
  }
  return {};
}

Status E57File::add(ByteView point) {
  for (std::size_t i = 0, at = 0; i < fields_.size(); at += fields_[i++].size())
    storage::append(streams_[i], point.subspan(at, fields_[i].size()));
  for (const std::byte one : point)
    for (std::uint64_t& sum : digest_) sum = (sum ^ std::to_integer<std::uint64_t>(one)) * 0x100000001b3;
  ++points_;
  return ++waiting_ < most_in_packet_ ? Status() : write_packet();
}

Status E57File::write_packet() {
  // Readers look for a packet of data even where there is no point.
  if (waiting_ == 0 && points_ > 0) return {};
  std::size_t size = storage::kE57PacketHead + 2 * streams_.size();
  for (const Bytes& stream : streams_) size += stream.size();
  const std::size_t padding = (4 - size % 4) % 4;
  Bytes packet;
  packet.reserve(size + padding);
  storage::append(packet, storage::kE57DataPacket);
  storage::append(packet, std::uint8_t{0});
  storage::append(packet, static_cast<std::uint16_t>(size + padding - 1));
  storage::append(packet, static_cast<std::uint16_t>(streams_.size()));
  for (const Bytes& stream : streams_) storage::append(packet, static_cast<std::uint16_t>(stream.size()));
  for (Bytes& stream : streams_) {
    storage::append(packet, stream);
    stream.clear();
  }
  packet.resize(size + padding);
  waiting_ = 0;
  return append(packet);
}

std::string E57File::description(const E57Scan& scan) const {
  const std::string guid =
      fmt::format("{{{:08x}-{:04x}-{:04x}-{:04x}-{:012x}}}", digest_[0] >> 32, digest_[0] >> 16 & 0xffff,
                  digest_[0] & 0xffff, digest_[1] >> 48, digest_[1] & 0xffffffffffff);
  std::string out =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<e57Root type=\"Structure\" xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\">\n";
  out += text_element("formatName", "ASTM E57 3D Imaging Data File");
  out += text_element("guid", guid);
  out += "<versionMajor type=\"Integer\">1</versionMajor>\n<versionMinor type=\"Integer\">0</versionMinor>\n";
  out += text_element("e57LibraryVersion", scan.software);
  if (!scan.crs.empty()) out += text_element("coordinateMetadata", scan.crs);
  out += "<data3D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n<vectorChild type=\"Structure\">\n";
  out += text_element("guid", guid);
  out += text_element("name", scan.name);
  if (scan.begin_s > 0)
    out += time_element("acquisitionStart", scan.begin_s) + time_element("acquisitionEnd", scan.end_s);
  if (points_ > 0) {
    out += "<cartesianBounds type=\"Structure\">\n";
    for (std::size_t i = 0; i < 3; ++i) {
      const char axis = "xyz"[i];
      out += number_element(axis + std::string("Minimum"), scan.minimum[i]);
      out += number_element(axis + std::string("Maximum"), scan.maximum[i]);
    }
    out += "</cartesianBounds>\n";
  }
  const auto limits = [&](const char* of, std::initializer_list<const char*> names, int most) {
    out += fmt::format("<{} type=\"Structure\">\n", of);
    for (const char* name : names)
      out += fmt::format("<{0}Minimum type=\"Integer\">0</{0}Minimum>\n<{0}Maximum type=\"Integer\">{1}</{0}Maximum>\n",
                         name, most);
    out += fmt::format("</{}>\n", of);
  };
  if (scan.has_intensity) limits("intensityLimits", {"intensity"}, 65535);
  if (scan.has_colour) limits("colorLimits", {"colorRed", "colorGreen", "colorBlue"}, 255);
  out += fmt::format(
      "<points type=\"CompressedVector\" fileOffset=\"{}\" recordCount=\"{}\">\n<prototype type=\"Structure\">\n",
      storage::kE57FileHeader, points_);
  for (const E57Field& field : fields_)
    out += field.type == E57Field::Type::Double
               ? fmt::format("<{} type=\"Float\" precision=\"double\"/>\n", field.name)
               : fmt::format("<{} type=\"Integer\" minimum=\"0\" maximum=\"{}\"/>\n", field.name,
                             field.type == E57Field::Type::U16 ? 65535 : 255);
  out +=
      "</prototype>\n<codecs type=\"Vector\" allowHeterogeneousChildren=\"1\"/>\n</points>\n</vectorChild>\n</data3D>\n"
      "<images2D type=\"Vector\" allowHeterogeneousChildren=\"1\"/>\n</e57Root>\n";
  return out;
}

Status E57File::close(const E57Scan& scan) {
  if (Status done = write_packet(); !done) return done;
  // One entry leads to the first packet. Readers go on from packet to packet.
  const std::uint64_t data = storage::kE57FileHeader + storage::kE57SectionHeader, index = written_;
  Bytes packet;
  storage::append(packet, storage::kE57IndexPacket);
  storage::append(packet, std::uint8_t{0});
  storage::append(packet, std::uint16_t{31});
  storage::append(packet, std::uint16_t{1});
  packet.resize(16);
  storage::append(packet, std::uint64_t{0});
  storage::append(packet, storage::e57_place_in_file(data));
  if (Status done = append(packet); !done) return done;
  const std::uint64_t xml = written_;
  const std::string text = description(scan);
  if (Status done = append(storage::as_bytes(text)); !done) return done;
  if (!page_.empty()) {
    page_.resize(storage::kE57Payload);
    if (Status done = write_page(); !done) return done;
  }
  Bytes head;
  storage::append(head, storage::as_bytes(storage::kE57Signature));
  storage::append(head, std::uint32_t{1});
  storage::append(head, std::uint32_t{0});
  storage::append(head, file_.size());
  storage::append(head, storage::e57_place_in_file(xml));
  storage::append(head, std::uint64_t{text.size()});
  storage::append(head, std::uint64_t{storage::kE57Page});
  storage::append(head, storage::kE57VectorSection);
  head.resize(storage::kE57FileHeader + 8);
  storage::append(head, xml - storage::kE57FileHeader);
  storage::append(head, storage::e57_place_in_file(data));
  storage::append(head, storage::e57_place_in_file(index));
  std::copy(head.begin(), head.end(), first_page_.begin());
  append_checksum(first_page_);
  if (Status done = file_.overwrite(0, first_page_); !done) return done;
  return file_.close();
}

}  // namespace hueline::products
