#include "apps/score/score_output.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "core/base64.hpp"
#include "core/output_file.hpp"
#include "score/sheet_text.hpp"
#include "storage/image_view.hpp"

namespace hueline::apps {
namespace {

std::string data_uri(const score::Picture& picture) {
  storage::RgbImage image(picture.width, picture.height, {});
  image.pixels = picture.pixels;
  const auto jpeg = storage::encode_jpeg(image, 88);
  if (!jpeg.ok()) return {};
  return "data:image/jpeg;base64," + base64({reinterpret_cast<const char*>(jpeg->data()), jpeg->size()});
}

}  // namespace

Status write_score(const std::filesystem::path& dir, const score::Sheet& sheet, const score::RunNotes& notes,
                   const std::vector<score::Change>& changes) {
  const auto folder = OutputFolder::open(dir);
  if (!folder.ok()) return folder.error();
  std::vector<std::vector<std::string>> pictures;
  for (const auto& one : sheet) {
    pictures.emplace_back();
    for (const auto& picture : one.pictures) pictures.back().push_back(data_uri(picture));
  }
  if (Status s = write_output(dir / "score.json", score::score_json(sheet)); !s.ok()) return s;
  if (Status s = write_output(dir / "score_notes.json", score::notes_json(sheet, notes)); !s.ok()) return s;
  if (Status s = write_output(dir / "score.md", score::markdown_table(sheet)); !s.ok()) return s;
  return write_output(dir / "score.html", score::page(sheet, pictures, notes, changes));
}

}  // namespace hueline::apps
