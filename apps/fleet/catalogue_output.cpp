#include "apps/fleet/catalogue_output.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "apps/fleet/catalogue_page.hpp"
#include "apps/fleet/postgis_catalogue.hpp"
#include "apps/fleet/postgres.hpp"
#include "core/output_file.hpp"

namespace hueline::apps {
namespace {

class GeoPackageOutput : public CatalogueOutput {
 public:
  explicit GeoPackageOutput(std::string file) : file_(std::move(file)) {}
  Status check() const override { return check_output(file_); }
  Result<std::string> write(const std::vector<CatalogueEntry>& entries) const override {
    const auto bytes = geopackage_of(entries);
    const Status written = bytes.ok() ? write_output(file_, *bytes) : Status(bytes.error());
    if (!written.ok()) return written.error();
    return "in " + file_;
  }

 private:
  std::string file_;
};

class PageOutput : public CatalogueOutput {
 public:
  explicit PageOutput(std::string file) : file_(std::move(file)) {}
  Status check() const override { return check_output(file_); }
  Result<std::string> write(const std::vector<CatalogueEntry>& entries) const override {
    const std::filesystem::path folder = std::filesystem::absolute(file_).lexically_normal().parent_path();
    const Status written = write_output(file_, catalogue_page(entries, folder));
    if (!written.ok()) return written.error();
    return "on " + file_;
  }

 private:
  std::string file_;
};

class PostgisOutput : public CatalogueOutput {
 public:
  explicit PostgisOutput(PostgresAddress address) : address_(std::move(address)) {}
  Status check() const override { return check_postgis(address_); }
  Result<std::string> write(const std::vector<CatalogueEntry>& entries) const override {
    const auto change = write_postgis(address_, entries);
    if (!change.ok()) return change.error();
    return fmt::format("in {}: {} new, {} replaced", address_.shown(), change->added, change->replaced);
  }

 private:
  PostgresAddress address_;
};

}  // namespace

Result<std::unique_ptr<CatalogueOutput>> CatalogueOutput::of(const std::string& out) {
  if (PostgresAddress::is_meant(out)) {
    auto address = PostgresAddress::parse(out);
    if (!address.ok()) return address.error();
    return std::unique_ptr<CatalogueOutput>(std::make_unique<PostgisOutput>(std::move(*address)));
  }
  if (out.find("://") != std::string::npos)
    return Error{ErrorCode::Invalid, "a catalogue is written to a file or to postgresql://USER@HOST/DATABASE"};
  if (out.ends_with(".html")) return std::unique_ptr<CatalogueOutput>(std::make_unique<PageOutput>(out));
  return std::unique_ptr<CatalogueOutput>(std::make_unique<GeoPackageOutput>(out));
}

}  // namespace hueline::apps
