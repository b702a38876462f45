#include "object_store/s3_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

#include "object_store/block_reader.hpp"
#include "object_store/s3_upload.hpp"

namespace hueline::object_store {
namespace {

constexpr BlockReader::Config kBlocks;

/// The last number of "bytes 0-1023/4096"; nothing if it has none.
std::optional<std::uint64_t> size_in(const std::string& content_range) {
  const auto slash = content_range.find('/');
  if (slash == std::string::npos) return {};
  const char *begin = content_range.data() + slash + 1, *end = content_range.data() + content_range.size();
  std::uint64_t size = 0;
  const auto [stop, wrong] = std::from_chars(begin, end, size);
  return wrong == std::errc() && stop == end ? std::optional(size) : std::nullopt;
}

/// Returns the address of an object. Errors: those of S3Address::parse(); Invalid for that of a folder.
Result<S3Address> object_address(const std::string& text) {
  auto address = S3Address::parse(text);
  if (address.ok() && (address->key.empty() || address->key.ends_with('/')))
    return Error{ErrorCode::Invalid, text + ": names a folder, and not an object"};
  return address;
}

/// Fetches parts of one object, as it was when it was opened.
class Object {
 public:
  Object(S3Client& client, S3Address address) : client_(client), address_(std::move(address)) {}

  /// Fetches the first bytes, and remembers which object it is. They may be fewer than asked for.
  Result<std::vector<std::byte>> open(std::size_t most) {
    std::vector<std::byte> head(most);
    const auto answer =
        client_.ask({.address = address_, .range = std::pair(std::uint64_t{0}, std::uint64_t{most}), .into = head});
    if (!answer.ok()) return answer.error();
    constexpr int kPartialContent = 206, kNoSuchRange = 416;
    if (answer->status == kNoSuchRange) return std::vector<std::byte>();  // an empty object
    const auto size = size_in(answer->header("content-range"));
    etag_ = answer->header("etag");
    if (answer->status != kPartialContent || !size || etag_.empty())
      return Error{ErrorCode::Unsupported,
                   name(address_) +
                       ": the server does not give parts of objects, with their ETag and size: copy the "
                       "object to this computer"};
    size_ = *size;
    if (answer->bytes != std::min<std::uint64_t>(most, size_))
      return Error{ErrorCode::Io, name(address_) + ": the server gives another part of the object than was asked for"};
    head.resize(answer->bytes);
    return head;
  }

  Status fetch(std::uint64_t offset, std::span<std::byte> out, const std::stop_token& stop) const {
    const auto answer = client_.ask({.address = address_,
                                     .headers = {{"If-Match", etag_}},
                                     .range = std::pair(offset, std::uint64_t{out.size()}),
                                     .into = out},
                                    stop);
    if (!answer.ok()) return answer.error();
    // Servers exist that do not know If-Match.
    if (answer->header("etag") != etag_ || size_in(answer->header("content-range")) != size_)
      return Error{ErrorCode::Io, name(address_) + ": the object was replaced while it was read: begin again"};
    if (answer->bytes != out.size())
      return Error{ErrorCode::Io, fmt::format("{}: {} bytes from byte {} on were asked for, and {} came",
                                              name(address_), out.size(), offset, answer->bytes)};
    return {};
  }

  std::uint64_t size() const { return size_; }

 private:
  S3Client& client_;
  S3Address address_;
  std::string etag_;
  std::uint64_t size_ = 0;
};

class S3File final : public RemoteFile {
 public:
  S3File(Object object, std::span<const std::byte> head)
      : object_(std::move(object)),
        blocks_(
            object_.size(),
            [this](std::uint64_t offset, std::span<std::byte> out, const std::stop_token& stop) {
              return object_.fetch(offset, out, stop);
            },
            kBlocks, head) {}
  std::uint64_t size() const override { return object_.size(); }
  Status read(std::uint64_t offset, std::span<std::byte> out) override { return blocks_.read(offset, out); }

 private:
  const Object object_;
  BlockReader blocks_;
};

}  // namespace

S3Store::S3Store(S3Access::Environment environment, std::function<void(const std::string&)> tell)
    : environment_(std::move(environment)), tell_(std::move(tell)) {}
S3Store::~S3Store() = default;

Result<S3Client*> S3Store::client() {
  const Lock lock(mutex_);
  if (!client_) {
    auto access = S3Access::read(environment_);
    if (!access.ok()) return access.error();
    client_ = std::make_unique<S3Client>(std::move(*access), tell_);
  }
  return client_.get();
}

Result<std::shared_ptr<RemoteFile>> S3Store::open(const std::string& text) {
  auto address = object_address(text);
  if (!address.ok()) return address.error();
  const auto asked = client();
  if (!asked.ok()) return asked.error();
  Object object(**asked, std::move(*address));
  const auto head = object.open(kBlocks.block_bytes);
  if (!head.ok()) return head.error();
  return std::shared_ptr<RemoteFile>(std::make_shared<S3File>(std::move(object), *head));
}

Result<std::vector<std::string>> S3Store::list(const std::string& folder) {
  auto address = S3Address::parse(folder);
  if (!address.ok()) return address.error();
  const auto asked = client();
  if (!asked.ok()) return asked.error();
  std::string prefix = address->key;
  if (!prefix.empty() && !prefix.ends_with('/')) prefix += '/';
  S3Client::Question question{.address = {address->bucket, ""},
                              .query = {{"delimiter", "/"}, {"list-type", "2"}, {"prefix", prefix}}};
  std::vector<std::string> names;
  for (;;) {
    const auto answer = (*asked)->ask(question);
    if (!answer.ok()) return answer.error();
    const std::string& xml = answer->text;
    const auto add = [&](const std::string& key) {
      if (key.starts_with(prefix) && key.size() > prefix.size()) names.push_back(key.substr(prefix.size()));
    };
    for (std::size_t at = 0; const auto key = xml_text(xml, "Key", at);) add(*key);
    std::size_t at = xml.find("<CommonPrefixes>");
    while (at < xml.size())
      if (const auto key = xml_text(xml, "Prefix", at))
        add(*key);
      else
        break;
    at = 0;
    const auto next = xml_text(xml, "NextContinuationToken", at);
    if (!next) return names;
    question.query["continuation-token"] = *next;
  }
}

Status S3Store::write(const std::string& text, const std::filesystem::path& file, const std::string& sha256) {
  auto address = object_address(text);
  if (!address.ok()) return address.error();
  const auto asked = client();
  if (!asked.ok()) return asked.error();
  return S3Upload(**asked, std::move(*address), sha256).send(file);
}

S3Traffic S3Store::traffic() {
  const Lock lock(mutex_);
  return client_ ? client_->traffic() : S3Traffic();
}

}  // namespace hueline::object_store
