#include <nlohmann/json.hpp>

#include "config/key_documents.hpp"
#include "config/rig.hpp"

namespace hueline::config {
namespace {

using Json = nlohmann::ordered_json;

/// Collects the properties of one mapping.
class SchemaWriter final : public Keys {
 public:
  void one_of(std::initializer_list<const char*> names) override {
    Json alternatives = Json::array();
    for (const char* name : names) alternatives.push_back({{"required", Json::array({name})}});
    exclusions_.push_back({{"oneOf", alternatives}});
  }

  /// Returns the schema of the mapping. Where a word decides which further keys it has, there is one schema for each
  /// word.
  Json schema() const {
    Json out = {{"type", "object"}};
    if (kinds_.empty()) {
      out["additionalProperties"] = false;
      out["properties"] = properties_;
      if (!required_.empty()) out["required"] = required_;
      if (!exclusions_.empty()) out["allOf"] = exclusions_;
      return out;
    }
    out["properties"] = properties_;
    out["required"] = required_;
    for (const auto& [word, of_word] : kinds_) {
      SchemaWriter whole = of_word;
      whole.properties_.update(properties_);
      whole.required_.insert(whole.required_.end(), required_.begin(), required_.end());
      whole.exclusions_.insert(whole.exclusions_.end(), exclusions_.begin(), exclusions_.end());
      out["allOf"].push_back(
          {{"if", {{"properties", {{kind_key_, {{"const", word}}}}}, {"required", Json::array({kind_key_})}}},
           {"then", whole.schema()}});
    }
    return out;
  }

 protected:
  bool take_number(const Key& key, std::optional<double>& value, const Range& range, bool is_whole) override {
    Json one = number(range, is_whole);
    if (value && !key.is_required) one["default"] = is_whole ? Json(static_cast<std::int64_t>(*value)) : Json(*value);
    return put(key, one);
  }
  bool take_flag(const Key& key, bool& value) override { return put(key, {{"type", "boolean"}, {"default", value}}); }
  bool take_text(const Key& key, std::string& value, const TextForm& form) override {
    Json one = text(form);
    if (!value.empty() && !key.is_required) one["default"] = value;
    return put(key, one);
  }
  bool take_word(const Key& key, std::optional<std::size_t>& chosen, const std::vector<std::string>& words) override {
    Json one = {{"enum", words}};
    if (chosen && !key.is_required) one["default"] = words[*chosen];
    return put(key, one);
  }
  bool take_numbers(const Key& key, std::vector<double>&, const Range& range, Count count, bool is_whole) override {
    return put(key, array(number(range, is_whole), count));
  }
  bool take_texts(const Key& key, std::vector<std::string>&, const TextForm& form) override {
    return put(key, array(text(form), {}));
  }
  bool take_section(const Key& key, const KeySection& section) override { return put(key, mapping(section.make())); }
  bool take_list(const Key& key, const KeyList& list, Count count) override {
    return put(key, array(mapping(list.add()), count));
  }
  bool take_kind(const Key& key, const KeyKinds& kinds) override {
    put(key, {{"enum", kinds.words}});
    for (std::size_t i = 0; i < kinds.words.size(); ++i) {
      if (!kinds.has_tables) {
        kinds.make(i).visit(*this);
        continue;
      }
      kind_key_ = key.name;
      kinds.make(i).visit(kinds_.emplace_back(kinds.words[i], SchemaWriter()).second);
    }
    return false;
  }

 private:
  static Json mapping(const KeyGroup& group) {
    SchemaWriter inside;
    group.visit(inside);
    return inside.schema();
  }
  static Json number(const Range& range, bool is_whole) {
    return {{"type", is_whole ? "integer" : "number"},
            {range.ends == Ends::MaxOnly ? "exclusiveMinimum" : "minimum", range.min},
            {range.ends == Ends::MinOnly ? "exclusiveMaximum" : "maximum", range.max}};
  }
  /// A YAML reader takes an unquoted 12345 for a number; this program takes it for a text.
  static Json text(const TextForm& form) {
    Json out = {{"type", Json::array({"string", "number"})}, {"minLength", 1}};
    if (*form.pattern) out["pattern"] = form.pattern;
    return out;
  }
  static Json array(Json items, Count count) {
    Json out = {{"type", "array"}, {"items", std::move(items)}};
    if (count.min > 0) out["minItems"] = count.min;
    if (count.max != Count{}.max) out["maxItems"] = count.max;
    return out;
  }
  bool put(const Key& key, Json one) {
    std::string what(key.what);
    if (!key.unit.empty()) what += " Unit: " + std::string(key.unit) + ".";
    if (!key.otherwise.empty()) what += " Without it: " + std::string(key.otherwise) + ".";
    one["description"] = what;
    properties_[std::string(key.name)] = std::move(one);
    if (key.is_required) required_.emplace_back(key.name);
    return false;
  }

  Json properties_ = Json::object();
  std::vector<std::string> required_;
  std::vector<Json> exclusions_;
  std::string kind_key_;
  std::vector<std::pair<std::string, SchemaWriter>> kinds_;
};

}  // namespace

Json rig_schema() {
  SchemaWriter writer;
  visit_rig_keys(writer);
  Json out = {{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", "hueline rig"}};
  out.update(writer.schema());
  return out;
}

}  // namespace hueline::config
