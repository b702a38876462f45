#include "apps/fleet/catalogue_output.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <utility>

#include "apps/fleet/catalogue_page.hpp"
#include "apps/fleet/postgis_catalogue.hpp"
#include "apps/fleet/postgres.hpp"
#include "core/output_file.hpp"

namespace hueline::apps {
namespace {

/// A file that is made as a whole and takes the place of what stood there.
class FileOutput : public CatalogueOutput {
 public:
  using Make = std::function<Result<std::string>(const std::vector<CatalogueEntry>&)>;
  /// `where` stands before the file's name for people: "in".
  FileOutput(std::string file, const char* where, Make make)
      : file_(std::move(file)), where_(where), make_(std::move(make)) {}
  Status check() const override { return check_output(file_); }
  Result<std::string> write(const std::vector<CatalogueEntry>& entries) const override {
    const auto bytes = make_(entries);
    const Status written = bytes.ok() ? write_output(file_, *bytes) : Status(bytes.error());
    if (!written.ok()) return written.error();
    return fmt::format("{} {}", where_, file_);
  }

 private:
  std::string file_;
  const char* where_;
  Make make_;
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
  if (!out.ends_with(".html") && !out.ends_with(".gpkg"))
    return Error{ErrorCode::Invalid, out +
                                         ": a catalogue is written as a GeoPackage (.gpkg), as a page (.html) or to "
                                         "postgresql://USER@HOST/DATABASE; give a name that ends so"};
  if (out.ends_with(".gpkg"))
    return std::unique_ptr<CatalogueOutput>(std::make_unique<FileOutput>(out, "in", geopackage_of));
  const std::filesystem::path folder = std::filesystem::absolute(out).lexically_normal().parent_path();
  return std::unique_ptr<CatalogueOutput>(std::make_unique<FileOutput>(
      out, "on", [folder](const auto& entries) { return Result(catalogue_page(entries, folder)); }));
}

}  // namespace hueline::apps
