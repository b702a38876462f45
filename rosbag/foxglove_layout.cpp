// Messages whose bytes do not name their fields: those of foxglove_msgs, and flatbuffers.

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

#include "rosbag/foxglove_part.hpp"

namespace hueline::rosbag {
namespace {

using drivers::RosReader;

/// What a field is. `Whole` has four bytes, `Numbers` are doubles, `Part` and `Parts` have a layout of their own.
enum class FieldKind : std::uint8_t { Byte, Whole, Number, Text, Bytes, Time, Numbers, Part, Parts };
struct LayoutField {
  std::string_view name;
  FieldKind kind;
  std::string_view part = {};  ///< whose layout a Part has
  std::uint32_t count = 0;     ///< how many Numbers ROS writes; 0: it writes that first
  double absent = 0;           ///< what a flatbuffer leaves out
};
using Layout = std::vector<LayoutField>;

/// The fields in the order of the messages of ROS, which is that of their numbers in flatbuffers. Messages may
/// have further fields behind these.
const Layout& layout_of(std::string_view schema) {
  using enum FieldKind;
  static const LayoutField kStamp{"timestamp", Time}, kFrame{"frame_id", Text};
  static const Layout kImage{kStamp, kFrame, {"data", Bytes}, {"format", Text}};
  static const std::map<std::string_view, Layout> kLayouts{
      {"Vector3", {{"x", Number}, {"y", Number}, {"z", Number}}},
      {"Quaternion", {{"x", Number}, {"y", Number}, {"z", Number}, {"w", Number, {}, 0, 1}}},
      {"Pose", {{"position", Part, "Vector3"}, {"orientation", Part, "Quaternion"}}},
      {"PackedElementField", {{"name", Text}, {"offset", Whole}, {"type", Byte}}},
      {"PointCloud",
       {kStamp,
        kFrame,
        {"pose", Part, "Pose"},
        {"point_stride", Whole},
        {"fields", Parts, "PackedElementField"},
        {"data", Bytes}}},
      {"CompressedImage", kImage},
      {"CompressedVideo", kImage},
      {"RawImage",
       {kStamp, kFrame, {"width", Whole}, {"height", Whole}, {"encoding", Text}, {"step", Whole}, {"data", Bytes}}},
      {"CameraCalibration",
       {kStamp,
        kFrame,
        {"width", Whole},
        {"height", Whole},
        {"distortion_model", Text},
        {"D", Numbers},
        {"K", Numbers, {}, 9},
        {"R", Numbers, {}, 9},
        {"P", Numbers, {}, 12}}},
      {"FrameTransform",
       {kStamp,
        {"parent_frame_id", Text},
        {"child_frame_id", Text},
        {"translation", Part, "Vector3"},
        {"rotation", Part, "Quaternion"}}},
      {"FrameTransforms", {{"transforms", Parts, "FrameTransform"}}},
      {"PoseInFrame", {kStamp, kFrame, {"pose", Part, "Pose"}}},
      {"PosesInFrame", {kStamp, kFrame, {"poses", Parts, "Pose"}}},
      {"LaserScan",
       {kStamp,
        kFrame,
        {"pose", Part, "Pose"},
        {"start_angle", Number},
        {"end_angle", Number},
        {"ranges", Numbers},
        {"intensities", Numbers}}},
      {"Odometry",
       {kStamp,
        kFrame,
        {"body_frame_id", Text},
        {"pose", Part, "Pose"},
        {"linear_velocity", Part, "Vector3"},
        {"angular_velocity", Part, "Vector3"},
        {"pose_covariance", Numbers, {}, 36},
        {"velocity_covariance", Numbers, {}, 36}}},
      {"LocationFix",
       {kStamp,
        kFrame,
        {"latitude", Number},
        {"longitude", Number},
        {"altitude", Number},
        {"position_covariance", Numbers, {}, 9},
        {"position_covariance_type", Byte}}}};
  const auto found = kLayouts.find(schema);
  if (found == kLayouts.end()) throw WrongForm{std::string(schema)};
  return found->second;
}

/// A message of ROS, of which each field stands behind the one before.
class RosPart final : public FoxglovePart {
 public:
  RosPart(RosReader& in, std::string_view schema) : values_(std::make_shared<Values>()) {
    for (const LayoutField& field : layout_of(schema)) {
      values_->emplace(field.name, read(in, field));
      if (!in.ok()) throw WrongForm{std::string(field.name)};
    }
  }

  double number(const std::string& name) const override { return get<double>(name); }
  std::string text(const std::string& name) const override { return get<std::string>(name); }
  std::string bytes(const std::string& name) const override {
    const auto& bytes = get<std::span<const std::byte>>(name);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  UnixTime time(const std::string& name) const override { return get<UnixTime>(name); }
  std::vector<double> numbers(const std::string& name) const override { return get<std::vector<double>>(name); }
  std::unique_ptr<FoxglovePart> part(const std::string& name) const override {
    return std::make_unique<RosPart>(get<std::vector<RosPart>>(name).at(0));
  }
  std::vector<std::unique_ptr<FoxglovePart>> parts(const std::string& name) const override {
    std::vector<std::unique_ptr<FoxglovePart>> out;
    for (const RosPart& one : get<std::vector<RosPart>>(name)) out.push_back(std::make_unique<RosPart>(one));
    return out;
  }

 private:
  using Value = std::variant<double, std::string, std::span<const std::byte>, UnixTime, std::vector<double>,
                             std::vector<RosPart>>;
  using Values = std::map<std::string_view, Value>;

  template <class T>
  const T& get(const std::string& name) const {
    const auto found = values_->find(name);
    const T* value = found == values_->end() ? nullptr : std::get_if<T>(&found->second);
    if (!value) throw WrongForm{name};
    return *value;
  }
  static Value read(RosReader& in, const LayoutField& field) {
    switch (field.kind) {
      case FieldKind::Byte:
        return static_cast<double>(in.take<std::uint8_t>());
      case FieldKind::Whole:
        return static_cast<double>(in.take<std::uint32_t>());
      case FieldKind::Number:
        return in.take<double>();
      case FieldKind::Text:
        return in.take_string();
      case FieldKind::Bytes:
        return in.take_byte_sequence();
      case FieldKind::Time: {
        const std::int64_t ns = count_ns(in.take_time());
        return foxglove_time(ns / 1'000'000'000, ns % 1'000'000'000);
      }
      case FieldKind::Numbers: {
        std::vector<double> out(field.count > 0 ? field.count : in.take_count(sizeof(double)));
        for (double& one : out) one = in.take<double>();
        return out;
      }
      case FieldKind::Part:
      case FieldKind::Parts:
        break;
    }
    constexpr std::size_t kLeastBytes = 9;  // of a PackedElementField
    const std::uint32_t count = field.kind == FieldKind::Part ? 1 : in.take_count(kLeastBytes);
    std::vector<RosPart> out;
    for (std::uint32_t i = 0; i < count; ++i) out.emplace_back(in, field.part);
    return out;
  }

  std::shared_ptr<Values> values_;
};

/// A table of a flatbuffer. Source: FlatBuffers, internals ("Tables", "Vectors"): a table begins with the distance back
/// to a list of where its fields are; texts, vectors and tables are named by the distance to them.
class FlatbufferPart final : public FoxglovePart {
 public:
  FlatbufferPart(std::span<const std::byte> all, std::size_t table, std::string_view schema)
      : all_(all), table_(table), layout_(&layout_of(schema)) {}

  double number(const std::string& name) const override {
    const auto at = place(name, {FieldKind::Byte, FieldKind::Whole, FieldKind::Number});
    if (!at) return field(name).absent;
    if (field(name).kind == FieldKind::Byte) return read<std::uint8_t>(*at);
    return field(name).kind == FieldKind::Whole ? read<std::uint32_t>(*at) : read<double>(*at);
  }
  std::string text(const std::string& name) const override {
    const auto at = place(name, {FieldKind::Text});
    if (!at) return {};
    const Vector text = vector(*at, 1);
    if (text.count > kMostOfAMessage) throw WrongForm{name};
    return {reinterpret_cast<const char*>(all_.data()) + text.begin, text.count};
  }
  std::string bytes(const std::string& name) const override {
    const auto at = place(name, {FieldKind::Bytes});
    if (!at) return {};
    const Vector bytes = vector(*at, 1);
    return {reinterpret_cast<const char*>(all_.data()) + bytes.begin, bytes.count};
  }
  UnixTime time(const std::string& name) const override {
    const auto at = place(name, {FieldKind::Time});
    return at ? foxglove_time(read<std::uint32_t>(*at), read<std::uint32_t>(*at + 4)) : UnixTime{};
  }
  std::vector<double> numbers(const std::string& name) const override {
    const auto at = place(name, {FieldKind::Numbers});
    if (!at) return {};
    const Vector numbers = vector(*at, sizeof(double));
    std::vector<double> out(numbers.count);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = read<double>(numbers.begin + i * sizeof(double));
    return out;
  }
  std::unique_ptr<FoxglovePart> part(const std::string& name) const override {
    const auto at = place(name, {FieldKind::Part});
    return at ? std::make_unique<FlatbufferPart>(all_, named_by(*at), field(name).part) : nullptr;
  }
  std::vector<std::unique_ptr<FoxglovePart>> parts(const std::string& name) const override {
    const auto at = place(name, {FieldKind::Parts});
    if (!at) return {};
    const Vector tables = vector(*at, sizeof(std::uint32_t));
    if (tables.count > kMostOfAMessage) throw WrongForm{name};
    std::vector<std::unique_ptr<FoxglovePart>> out;
    for (std::size_t i = 0; i < tables.count; ++i)
      out.push_back(
          std::make_unique<FlatbufferPart>(all_, named_by(tables.begin + i * sizeof(std::uint32_t)), field(name).part));
    return out;
  }

 private:
  /// Parts, and bytes of a text: many parts may name one text, so a small message could become a large one.
  static constexpr std::size_t kMostOfAMessage = 4096;
  struct Vector {
    std::size_t begin = 0, count = 0;
  };

  template <class T>
  T read(std::size_t at) const {
    if (at > all_.size() || all_.size() - at < sizeof(T)) throw WrongForm{"its bytes are no flatbuffer"};
    T value{};
    std::memcpy(&value, all_.data() + at, sizeof value);
    return value;
  }
  std::size_t named_by(std::size_t at) const { return at + read<std::uint32_t>(at); }
  Vector vector(std::size_t at, std::size_t element_bytes) const {
    const std::size_t begin = named_by(at);
    const Vector out{begin + sizeof(std::uint32_t), read<std::uint32_t>(begin)};
    if (out.count > (all_.size() - out.begin) / element_bytes) throw WrongForm{"its bytes are no flatbuffer"};
    return out;
  }
  const LayoutField& field(const std::string& name) const {
    const auto found = std::ranges::find(*layout_, name, &LayoutField::name);
    if (found == layout_->end()) throw WrongForm{name};
    return *found;
  }
  /// Returns where a field is; nothing: it is not there.
  std::optional<std::size_t> place(const std::string& name, std::initializer_list<FieldKind> kinds) const {
    const LayoutField& found = field(name);
    if (std::ranges::find(kinds, found.kind) == kinds.end()) throw WrongForm{name};
    const auto index = static_cast<std::size_t>(&found - layout_->data());
    const std::int64_t list = static_cast<std::int64_t>(table_) - read<std::int32_t>(table_);
    if (list < 0) throw WrongForm{"its bytes are no flatbuffer"};
    const auto begin = static_cast<std::size_t>(list);
    const std::size_t slot = 2 * sizeof(std::uint16_t) + index * sizeof(std::uint16_t);
    if (slot + sizeof(std::uint16_t) > read<std::uint16_t>(begin)) return {};
    const auto offset = read<std::uint16_t>(begin + slot);
    return offset == 0 ? std::nullopt : std::optional(table_ + offset);
  }

  std::span<const std::byte> all_;
  std::size_t table_;
  const Layout* layout_;
};

}  // namespace

std::unique_ptr<FoxglovePart> part_of_ros(const std::string& schema, RosReader message) {
  return std::make_unique<RosPart>(message, schema);
}

std::unique_ptr<FoxglovePart> part_of_flatbuffer(const std::string& schema, std::span<const std::byte> message) {
  if (message.size() < sizeof(std::uint32_t)) throw WrongForm{"its bytes are no flatbuffer"};
  std::uint32_t table = 0;
  std::memcpy(&table, message.data(), sizeof table);
  return std::make_unique<FlatbufferPart>(message, table, schema);
}

}  // namespace hueline::rosbag
