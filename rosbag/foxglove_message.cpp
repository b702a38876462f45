#include "rosbag/foxglove_message.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/message.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/timestamp.pb.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/portable_math.hpp"
#include "core/time.hpp"
#include "rosbag/foxglove_part.hpp"

namespace hueline::rosbag {
namespace {

namespace pb = google::protobuf;

/// Writes the fields of a message of ROS 1.
class Ros1Writer {
 public:
  template <class T>
  Ros1Writer& put(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Ros1Writer& text(std::string_view s) {
    put(static_cast<std::uint32_t>(s.size()));
    bytes_ += s;
    return *this;
  }
  Ros1Writer& time(UnixTime time) {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    put(static_cast<std::uint32_t>(count_ns(time) / kSecond_ns));
    return put(static_cast<std::uint32_t>(count_ns(time) % kSecond_ns));
  }
  Ros1Writer& header(UnixTime stamp, std::string_view frame) { return put(std::uint32_t{0}).time(stamp).text(frame); }
  /// Exactly `count` numbers; those of a list that is empty are 0.
  Ros1Writer& numbers(const FoxglovePart& from, const std::string& field, std::size_t count) {
    auto values = from.numbers(field);
    if (values.empty()) values.resize(count);
    if (values.size() != count) throw WrongForm{field};
    for (const double value : values) put(value);
    return *this;
  }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

/// How far the length of a rotation's four numbers may be from 1.
constexpr double kUnit = 0.01;

Eigen::Vector3d vector_of(const FoxglovePart* from) {
  return from ? Eigen::Vector3d(from->number("x"), from->number("y"), from->number("z")) : Eigen::Vector3d::Zero();
}
/// A rotation that is not there, or of zeros, as protobuf reads it then, is none. A flatbuffer leaves out the w of half
/// a turn, 0, or that of no rotation, 1, by the version of its schema.
Eigen::Quaterniond rotation_of(const FoxglovePart* from) {
  if (!from) return Eigen::Quaterniond::Identity();
  const Eigen::Vector3d v = vector_of(from);
  double w = from->number("w");
  if (w == 1 && std::abs(v.norm() - 1) < kUnit) w = 0;
  return w == 0 && v.isZero(0) ? Eigen::Quaterniond::Identity() : Eigen::Quaterniond(w, v.x(), v.y(), v.z());
}
void put_place(Ros1Writer& out, const Eigen::Vector3d& t, const Eigen::Quaterniond& q) {
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) out.put(value);
}

struct CloudField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t type = 0;  // of sensor_msgs/PointField
};
constexpr std::uint8_t kFloat32 = 7, kFloat64 = 8;

/// Returns where a cloud lies in its frame; nothing: where the frame does.
std::optional<Eigen::Isometry3d> pose_of(const FoxglovePart& in) {
  const auto pose = in.part("pose");
  if (!pose) return {};
  const Eigen::Quaterniond q = rotation_of(pose->part("orientation").get());
  if (!(std::abs(q.norm() - 1) < kUnit)) throw WrongForm{"pose"};
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = q.normalized().toRotationMatrix();
  T.translation() = vector_of(pose->part("position").get());
  return T.matrix().isIdentity(1e-9) ? std::nullopt : std::optional(T);
}

/// Turns the points into their frame. One at (0, 0, 0) is no return, and stays there.
void place_points(std::string& data, std::size_t stride, const std::vector<CloudField>& fields,
                  const Eigen::Isometry3d& T_frame_cloud) {
  std::array<const CloudField*, 3> axes{};
  for (const CloudField& one : fields)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (one.name == std::string(1, "xyz"[axis])) axes[axis] = &one;
  for (const CloudField* one : axes)
    if (!one || one->type < kFloat32 || one->offset + (one->type == kFloat32 ? 4U : 8U) > stride)
      throw WrongForm{"x, y and z of a cloud with a pose"};
  for (std::size_t at = 0; at + stride <= data.size(); at += stride) {
    Eigen::Vector3d point;
    const auto each = [&](const auto& exchange) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        char* const bytes = &data[at + axes[axis]->offset];
        double& value = point[static_cast<Eigen::Index>(axis)];
        axes[axis]->type == kFloat32 ? exchange(bytes, value, float{}) : exchange(bytes, value, double{});
      }
    };
    each([](const char* from, double& to, auto number) {
      std::memcpy(&number, from, sizeof number);
      to = static_cast<double>(number);
    });
    if (point.isZero(0)) continue;
    point = T_frame_cloud * point;
    each([](char* to, const double& from, auto number) {
      number = static_cast<decltype(number)>(from);
      std::memcpy(to, &number, sizeof number);
    });
  }
}

/// Writes what follows the header of a sensor_msgs/PointCloud2.
void put_cloud(Ros1Writer& out, const std::vector<CloudField>& fields, std::uint32_t stride, const std::string& data) {
  out.put(std::uint32_t{1}).put(static_cast<std::uint32_t>(data.size() / stride));
  out.put(static_cast<std::uint32_t>(fields.size()));
  for (const CloudField& one : fields) out.text(one.name).put(one.offset).put(one.type).put(std::uint32_t{1});
  out.put(std::uint8_t{0}).put(stride).put(static_cast<std::uint32_t>(data.size())).text(data).put(std::uint8_t{0});
}

void turn_cloud(const FoxglovePart& in, Ros1Writer& out) {
  // By PackedElementField's numbers: unknown, uint8, int8, uint16, int16, uint32, int32, float32, float64.
  constexpr std::array<std::uint8_t, 9> kTypes{0, 2, 1, 4, 3, 6, 5, kFloat32, kFloat64};
  std::vector<CloudField> fields;
  for (const auto& one : in.parts("fields")) {
    const std::uint32_t type = one->whole("type");
    if (type >= kTypes.size()) throw WrongForm{"fields"};
    fields.push_back({one->text("name"), one->whole("offset"), kTypes[type]});
  }
  const std::uint32_t stride = in.whole("point_stride");
  std::string data = in.bytes("data");
  if (stride == 0 || data.size() % stride != 0 || data.size() > std::numeric_limits<std::uint32_t>::max())
    throw WrongForm{"point_stride"};
  if (const auto T_frame_cloud = pose_of(in)) place_points(data, stride, fields, *T_frame_cloud);
  put_cloud(out.header(in.time("timestamp"), in.text("frame_id")), fields, stride, data);
}

/// The angles go on evenly from the first range to the last. What is not above 0, or no number, is no return.
void turn_scan(const FoxglovePart& in, Ros1Writer& out) {
  const auto ranges = in.numbers("ranges"), intensities = in.numbers("intensities");
  const double begin = in.number("start_angle"), end = in.number("end_angle");
  if (!std::isfinite(begin) || !std::isfinite(end)) throw WrongForm{"start_angle and end_angle"};
  const bool has_intensities = intensities.size() == ranges.size();
  const double step = ranges.size() > 1 ? (end - begin) / static_cast<double>(ranges.size() - 1) : 0;
  Ros1Writer points;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double range = ranges[i] > 0 && std::isfinite(ranges[i]) ? ranges[i] : 0;
    const double angle = begin + static_cast<double>(i) * step;
    points.put(static_cast<float>(range * portable::cos(angle))).put(static_cast<float>(range * portable::sin(angle)));
    points.put(0.F).put(has_intensities ? static_cast<float>(intensities[i]) : 0.F);
  }
  std::vector<CloudField> fields{{"x", 0, kFloat32}, {"y", 4, kFloat32}, {"z", 8, kFloat32}};
  if (has_intensities) fields.push_back({"intensity", 12, kFloat32});
  constexpr std::uint32_t kStride = 16;
  if (const auto T_frame_scan = pose_of(in)) place_points(points.bytes(), kStride, fields, *T_frame_scan);
  put_cloud(out.header(in.time("timestamp"), in.text("frame_id")), fields, kStride, points.bytes());
}

void turn_compressed_image(const FoxglovePart& in, Ros1Writer& out) {
  out.time(in.time("timestamp")).text(in.text("frame_id")).text(in.bytes("data")).text(in.text("format"));
}

void turn_raw_image(const FoxglovePart& in, Ros1Writer& out) {
  out.time(in.time("timestamp")).text(in.text("frame_id")).put(in.whole("width")).put(in.whole("height"));
  out.text(in.text("encoding")).put(in.whole("step")).text(in.bytes("data"));
}

void turn_calibration(const FoxglovePart& in, Ros1Writer& out) {
  out.header(in.time("timestamp"), in.text("frame_id")).put(in.whole("height")).put(in.whole("width"));
  const auto distortion = in.numbers("D");
  out.text(in.text("distortion_model")).put(static_cast<std::uint32_t>(distortion.size()));
  for (const double value : distortion) out.put(value);
  out.numbers(in, "K", 9).numbers(in, "R", 9).numbers(in, "P", 12);
  for (int i = 0; i < 6; ++i) out.put(std::uint32_t{0});  // binning and region of interest: none
  out.put(std::uint8_t{0});
}

void turn_transform(const FoxglovePart& in, Ros1Writer& out) {
  out.header(in.time("timestamp"), in.text("parent_frame_id")).text(in.text("child_frame_id"));
  put_place(out, vector_of(in.part("translation").get()), rotation_of(in.part("rotation").get()));
}
void turn_one_transform(const FoxglovePart& in, Ros1Writer& out) { turn_transform(in, out.put(std::uint32_t{1})); }
void turn_transforms(const FoxglovePart& in, Ros1Writer& out) {
  const auto transforms = in.parts("transforms");
  out.put(static_cast<std::uint32_t>(transforms.size()));
  for (const auto& one : transforms) turn_transform(*one, out);
}

void put_pose_of(const FoxglovePart& pose, Ros1Writer& out) {
  put_place(out, vector_of(pose.part("position").get()), rotation_of(pose.part("orientation").get()));
}
void put_pose(const FoxglovePart& in, Ros1Writer& out) {
  const auto pose = in.part("pose");
  if (!pose) throw WrongForm{"pose"};
  put_pose_of(*pose, out);
}

void turn_pose(const FoxglovePart& in, Ros1Writer& out) {
  put_pose(in, out.header(in.time("timestamp"), in.text("frame_id")));
}

void turn_poses(const FoxglovePart& in, Ros1Writer& out) {
  const auto poses = in.parts("poses");
  out.header(in.time("timestamp"), in.text("frame_id")).put(static_cast<std::uint32_t>(poses.size()));
  for (const auto& one : poses) put_pose_of(*one, out);
}

void turn_odometry(const FoxglovePart& in, Ros1Writer& out) {
  put_pose(in, out.header(in.time("timestamp"), in.text("frame_id")).text(in.text("body_frame_id")));
  out.numbers(in, "pose_covariance", 36);
  for (const char* field : {"linear_velocity", "angular_velocity"})
    for (const double value : vector_of(in.part(field).get())) out.put(value);
  out.numbers(in, "velocity_covariance", 36);
}

void turn_fix(const FoxglovePart& in, Ros1Writer& out) {
  out.header(in.time("timestamp"), in.text("frame_id")).put(std::int8_t{0}).put(std::uint16_t{0});
  for (const char* field : {"latitude", "longitude", "altitude"}) out.put(in.number(field));
  out.numbers(in, "position_covariance", 9).put(static_cast<std::uint8_t>(in.whole("position_covariance_type")));
}

constexpr std::string_view kFoxglove = "foxglove.", kFoxgloveMsgs = "foxglove_msgs/";
using Turn = void (*)(const FoxglovePart&, Ros1Writer&);
struct Schema {
  std::string ros;
  Turn turn;
};
const std::map<std::string, Schema>& known_schemas() {
  static const std::map<std::string, Schema> kSchemas{
      {"foxglove.PointCloud", {"sensor_msgs/PointCloud2", turn_cloud}},
      {"foxglove.CompressedImage", {"foxglove_msgs/CompressedImage", turn_compressed_image}},
      {"foxglove.CompressedVideo", {"foxglove_msgs/CompressedVideo", turn_compressed_image}},
      {"foxglove.RawImage", {"foxglove_msgs/RawImage", turn_raw_image}},
      {"foxglove.CameraCalibration", {"sensor_msgs/CameraInfo", turn_calibration}},
      {"foxglove.FrameTransform", {"tf2_msgs/TFMessage", turn_one_transform}},
      {"foxglove.FrameTransforms", {"tf2_msgs/TFMessage", turn_transforms}},
      {"foxglove.PoseInFrame", {"geometry_msgs/PoseStamped", turn_pose}},
      {"foxglove.PosesInFrame", {"geometry_msgs/PoseArray", turn_poses}},
      {"foxglove.LaserScan", {"sensor_msgs/PointCloud2", turn_scan}},
      {"foxglove.Odometry", {"nav_msgs/Odometry", turn_odometry}},
      {"foxglove.LocationFix", {"sensor_msgs/NavSatFix", turn_fix}}};
  return kSchemas;
}

class Reader : public FoxgloveReader {
 public:
  explicit Reader(const Schema& schema) : schema_(schema) {}
  const std::string& type() const override { return schema_.ros; }

 protected:
  Result<Buffer> written(const std::function<void(Ros1Writer&, Turn)>& read) const {
    Ros1Writer out;
    try {
      read(out, schema_.turn);
    } catch (const WrongForm& wrong) {
      return Error{ErrorCode::Malformed, "it does not have the form of its schema (" + wrong.what + ")"};
    }
    return Buffer::copy_of(std::as_bytes(std::span(out.bytes())));
  }

 private:
  Schema schema_;
};

class JsonReader final : public Reader {
 public:
  using Reader::Reader;
  Result<Buffer> turned(std::span<const std::byte> message) const override {
    return written([&](Ros1Writer& out, Turn turn) {
      const std::string_view text(reinterpret_cast<const char*>(message.data()), message.size());
      const auto json = nlohmann::json::parse(text, nullptr, false);
      turn(*part_of(json), out);
    });
  }
};

/// Messages whose bytes do not name their fields. `name`: that of the schema, "PointCloud".
class FlatbufferReader final : public Reader {
 public:
  FlatbufferReader(const Schema& schema, std::string name) : Reader(schema), name_(std::move(name)) {}
  Result<Buffer> turned(std::span<const std::byte> message) const override {
    return written([&](Ros1Writer& out, Turn turn) { turn(*part_of_flatbuffer(name_, message), out); });
  }

 private:
  std::string name_;
};

class RosMessageReader final : public Reader {
 public:
  RosMessageReader(const Schema& schema, std::string name, drivers::RosEncoding encoding)
      : Reader(schema), name_(std::move(name)), encoding_(encoding) {}
  Result<Buffer> turned(std::span<const std::byte> message) const override {
    return written([&](Ros1Writer& out, Turn turn) { turn(*part_of_ros(name_, {message, encoding_}), out); });
  }

 private:
  std::string name_;
  drivers::RosEncoding encoding_;
};

/// Keeps what is wrong with a schema for itself.
class NoErrors final : public pb::DescriptorPool::ErrorCollector {
 public:
  void AddError(const std::string&, const std::string&, const pb::Message*, ErrorLocation,
                const std::string&) override {}
};

class ProtobufReader final : public Reader {
 public:
  using Reader::Reader;
  /// Returns false if `descriptors` does not describe the message `name`.
  bool open(const std::string& name, const std::string& descriptors) {
    const pb::LogSilencer quiet;  // of texts that are no UTF-8
    pb::FileDescriptorSet files;
    if (!files.ParsePartialFromString(descriptors)) return false;
    std::map<std::string, const pb::FileDescriptorProto*> by_name;
    for (const pb::FileDescriptorProto& file : files.file()) by_name[file.name()] = &file;
    pb::FileDescriptorProto stamp;  // some writers leave out what every program has
    pb::Timestamp::descriptor()->file()->CopyTo(&stamp);
    by_name.try_emplace(stamp.name(), &stamp);
    constexpr int kDeepest = 100;
    NoErrors silent;
    const std::function<void(const std::string&, int)> build = [&](const std::string& file, int depth) {
      const auto found = by_name.find(file);
      if (found == by_name.end() || depth == kDeepest || pool_.FindFileByName(file)) return;
      for (const std::string& needed : found->second->dependency()) build(needed, depth + 1);
      pool_.BuildFileCollectingErrors(*found->second, &silent);
    };
    for (const auto& [file, unused] : by_name) build(file, 0);
    const pb::Descriptor* message = pool_.FindMessageTypeByName(name);
    if (message) prototype_ = factory_.GetPrototype(message);
    return prototype_ != nullptr;
  }
  Result<Buffer> turned(std::span<const std::byte> bytes) const override {
    return written([&](Ros1Writer& out, Turn turn) {
      const pb::LogSilencer quiet;
      const std::unique_ptr<pb::Message> message(prototype_->New());
      if (bytes.size() > std::numeric_limits<int>::max() ||
          !message->ParsePartialFromArray(bytes.data(), static_cast<int>(bytes.size())))
        throw WrongForm{"its bytes are no protobuf"};
      turn(*part_of(*message), out);
    });
  }

 private:
  pb::DescriptorPool pool_;
  mutable pb::DynamicMessageFactory factory_{&pool_};
  const pb::Message* prototype_ = nullptr;
};

}  // namespace

Result<std::unique_ptr<FoxgloveReader>> FoxgloveReader::make(const storage::McapSchema& schema,
                                                             const std::string& message_encoding) {
  const bool is_known =
      message_encoding == "protobuf" || message_encoding == "json" || message_encoding == "flatbuffer";
  if (!is_known) return Error{ErrorCode::Unsupported, "its messages are not of ROS but \"" + message_encoding + "\""};
  const auto known = known_schemas().find(schema.name);
  if (known == known_schemas().end())
    return Error{ErrorCode::Unsupported, "of messages in " + message_encoding +
                                             " those in Foxglove's schemas of clouds, images, calibrations, " +
                                             "transforms, poses and fixes are read"};
  if (message_encoding == "json") return std::unique_ptr<FoxgloveReader>(std::make_unique<JsonReader>(known->second));
  if (message_encoding == "flatbuffer")
    return std::unique_ptr<FoxgloveReader>(
        std::make_unique<FlatbufferReader>(known->second, schema.name.substr(kFoxglove.size())));
  auto reader = std::make_unique<ProtobufReader>(known->second);
  if (!reader->open(schema.name, schema.data))
    return Error{ErrorCode::Unsupported, "the recording has no schema of its messages in protobuf"};
  return std::unique_ptr<FoxgloveReader>(std::move(reader));
}

std::unique_ptr<FoxgloveReader> FoxgloveReader::of_ros(const std::string& type, drivers::RosEncoding encoding) {
  if (!type.starts_with(kFoxgloveMsgs)) return nullptr;
  const std::string name = type.substr(kFoxgloveMsgs.size());
  const auto known = known_schemas().find(std::string(kFoxglove) + name);
  if (known == known_schemas().end() || known->second.ros == type) return nullptr;
  return std::make_unique<RosMessageReader>(known->second, name, encoding);
}

}  // namespace hueline::rosbag
