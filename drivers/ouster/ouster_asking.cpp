#include "drivers/ouster/ouster_asking.hpp"

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {
namespace {

constexpr nanoseconds kMetadataPeriod = std::chrono::seconds(10), kTimePeriod = std::chrono::seconds(1);

/// A text command, and the section of the metadata that its answer is.
struct Part {
  const char* command;
  const char* section;
};
constexpr std::array<Part, 6> kParts{{{"get_sensor_info\n", "sensor_info"},
                                      {"get_beam_intrinsics\n", "beam_intrinsics"},
                                      {"get_lidar_intrinsics\n", "lidar_intrinsics"},
                                      {"get_imu_intrinsics\n", "imu_intrinsics"},
                                      {"get_lidar_data_format\n", "lidar_data_format"},
                                      {"get_config_param active\n", "config_params"}}};

/// Puts the answers to the commands together as the page of newer firmware has them. Old firmware answers some with
/// an error, because it does not know them.
std::string together(const std::vector<std::string>& answers) {
  std::string out;
  for (std::size_t i = 0; i < answers.size() && i < kParts.size(); ++i)
    if (answers[i].starts_with('{'))
      out += std::string(out.empty() ? "{" : ", ") + '"' + kParts[i].section + "\": " + answers[i];
  return out.empty() ? out : out + "}";
}

}  // namespace

OusterAskingSource::OusterAskingSource(std::unique_ptr<PacketSource> datagrams, Config config)
    : datagrams_(std::move(datagrams)), config_(std::move(config)) {}

Status OusterAskingSource::open() {
  close();
  return datagrams_->open();
}

void OusterAskingSource::close() {
  exchange_.reset();
  next_metadata_.reset();
  next_time_.reset();
  metadata_.clear();
  waiting_.clear();
  datagrams_->close();
}

void OusterAskingSource::ask(HostTime now) {
  if (!next_metadata_ || now >= *next_metadata_) {
    subject_ = Subject::Metadata;
    next_metadata_ = now + (metadata_.empty() ? kTimePeriod : kMetadataPeriod);
  } else if (!next_time_ || now >= *next_time_) {
    subject_ = Subject::Time;
    next_time_ = now + kTimePeriod;
  } else {
    return;
  }
  TextExchange::Config what;
  what.address = config_.address;
  if (uses_text_) {
    what.port = config_.text_port;
    if (subject_ == Subject::Time)
      what.questions = {"get_time_info\n"};
    else
      for (const Part& part : kParts) what.questions.emplace_back(part.command);
  } else {
    what.port = config_.http_port;
    what.ends_by_close = true;
    what.questions = {
        http_question(config_.address, subject_ == Subject::Time ? "/api/v1/time" : "/api/v1/sensor/metadata")};
  }
  exchange_.emplace(std::move(what), now);
}

void OusterAskingSource::deliver(const std::string& text, HostTime now) {
  Packet packet;
  packet.received = now;
  packet.bytes = Buffer::copy_of(std::as_bytes(std::span(text)));
  waiting_.push_back(std::move(packet));
}

void OusterAskingSource::take(const Result<std::vector<std::string>>& answers, HostTime now) {
  std::string text;
  std::optional<Error> error;
  if (!answers.ok()) {
    error = answers.error();
  } else if (uses_text_) {
    text = subject_ == Subject::Metadata ? together(*answers) : answers->at(0);
    if (!text.starts_with('{')) error = Error{ErrorCode::Unavailable, "text commands are not answered by JSON"};
  } else if (auto body = http_body(answers->at(0)); body.ok()) {
    text = std::move(body).value();
  } else {
    error = body.error();
  }
  if (error) {
    // A scanner that does not know the page of metadata, or has no server of HTTP, may know the text commands.
    if (subject_ == Subject::Metadata) uses_text_ = !uses_text_;
    waiting_.push_back(fault_packet(
        now, FaultKind::Refused, 1,
        (subject_ == Subject::Metadata ? "asking the Ouster for its metadata: " : "asking the Ouster for its time: ") +
            error->message +
            "; its data cannot be read without its metadata, nor its "
            "clock trusted without its time"));
    return;
  }
  if (subject_ == Subject::Metadata) {
    if (text == metadata_) return;
    metadata_ = text;
    next_metadata_ = now + kMetadataPeriod;
  }
  deliver(text, now);
}

Result<Packet> OusterAskingSource::next(std::stop_token stop) {
  const HostTime now = host_now();
  if (!exchange_) ask(now);
  if (exchange_)
    if (const auto answers = exchange_->step(now)) {
      exchange_.reset();
      take(*answers, now);
    }
  if (!waiting_.empty()) {
    Packet packet = std::move(waiting_.front());
    waiting_.pop_front();
    return packet;
  }
  return datagrams_->next(std::move(stop));
}

}  // namespace hueline::drivers
