#include "render/gltf/check/gltf_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "render/gltf/check/gltf_files.h"
#include "render/gltf/check/gltf_rules.h"
#include "render/gltf/gltf_extensions.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx::render {
namespace {

using namespace nlohmann::literals;
using Json = nlohmann::json;

/// "mesh" of "meshes", "light" of "extensions.KHR_lights_punctual.lights".
std::string singular(std::string_view array) {
    std::string name(array.substr(array.rfind('.') + 1));
    name.resize(name.size() - (name == "meshes" ? 2 : 1));
    return name;
}

/// A value as it is in the file, cut where it is long.
std::string shown(const Json& value) {
    if (value.is_object()) return "an object";
    std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (text.size() > 40) text = text.substr(0, 37) + "...";
    return text;
}

bool isUnit(const Json& value) { return value.get<double>() >= 0 && value.get<double>() <= 1; }

/// But for the rounding of few digits.
bool hasUnitLength(const Json& quaternion) {
    double squares = 0;
    for (const Json& v : quaternion) squares += v.get<double>() * v.get<double>();
    return std::abs(std::sqrt(squares) - 1) < 0.01;
}

class Checker {
  public:
    Checker(const std::string& file, const Json& root) : file_(file), root_(root) {}

    void check() {
        if (!root_.is_object()) throw Error(file_, "expected a JSON object, found " + shown(root_));
        checkVersion();
        checkRequired();
        for (const GltfRule& rule : gltfRules()) check(root_, rule, rule.place, "");
        checkTextures();
        checkCompressed();
        checkGltfFiles(file_, root_);
    }

    std::vector<std::string> warnings() const {
        if (unlisted_ == 0) return warnings_;
        std::vector<std::string> all = warnings_;
        all.push_back("and " + std::to_string(unlisted_) + " values more that are out of range");
        return all;
    }

  private:
    [[noreturn]] void fail(const std::string& where, const std::string& expected, const Json& found) const {
        throw Error(file_, where + ": expected " + expected + ", found " + shown(found));
    }

    /// What is read as something else. Ten: a scene of a thousand materials may have a thousand.
    void doubt(const std::string& where, const std::string& expected, const Json& found,
               const std::string& taken) {
        if (warnings_.size() == 10)
            ++unlisted_;
        else
            warnings_.push_back(where + ": expected " + expected + ", found " + shown(found) + ": " + taken);
    }

    void checkVersion() const {
        const auto asset = root_.find("asset");
        if (asset == root_.end() || !asset->is_object())
            throw Error(file_, "expected a glTF file, found JSON without `asset`");
        const auto major = [&](const char* key) {
            const auto version = asset->find(key);
            if (version == asset->end()) return std::string("2");
            if (!version->is_string()) fail(std::string("asset.") + key, "a string", *version);
            return split(version->get<std::string>(), '.')[0];
        };
        const std::string version = major("version");
        if (version == "2" && major("minVersion") == "2" && asset->value("minVersion", "2.0") == "2.0")
            return;
        const std::string least = asset->value("minVersion", "");
        const std::string found = asset->value("version", "2.0");
        throw Error(file_,
                    "expected glTF 2.0, found " + (version == "2" ? "a need for " + least : found) +
                        (version == "1" ? "; turn it into 2.0, for example with `gltf-pipeline -i IN -o OUT`"
                                        : "; export it as 2.0"));
    }

    void checkRequired() const {
        const auto required = root_.find("extensionsRequired");
        if (required == root_.end()) return;
        if (!required->is_array()) fail("extensionsRequired", "an array", *required);
        std::vector<std::string> missing;
        for (const Json& name : *required) {
            if (!name.is_string()) fail("extensionsRequired", "names", name);
            if (!isSupported(name.get<std::string>())) missing.push_back(name.get<std::string>());
        }
        if (missing.empty()) return;
        std::string remedies;
        for (const std::string& name : missing) {
            const std::string remedy = remedyFor(name);
            if (remedies.find(remedy) == std::string::npos) remedies += remedy;
        }
        throw Error(file_,
                    std::string("requires the extension") + (missing.size() > 1 ? "s " : " ") +
                        listed(missing) +
                        (missing.size() > 1 ? ", which are not supported" : ", which is not supported") +
                        (remedies.empty() ? "; export it without" : remedies));
    }

    /// `rest` of a rule's place, from `value` on, which is at `where`.
    void check(const Json& value, const GltfRule& rule, std::string_view rest, const std::string& where) {
        if (rest.empty()) return checkValue(value, rule, where);
        if (rest.starts_with("[]")) {
            if (!value.is_array()) fail(where, "an array", value);
            rest.remove_prefix(rest.starts_with("[].") ? 3 : 2);
            for (std::size_t i = 0; i < value.size(); ++i)
                check(value[i], rule, rest, where + "[" + std::to_string(i) + "]");
            return;
        }
        if (!value.is_object()) fail(where, "an object", value);
        const std::size_t end = std::min(rest.find('.'), rest.find('['));
        const std::string name(rest.substr(0, end));
        rest.remove_prefix(std::min(rest.size(), name.size()));
        if (rest.starts_with('.')) rest.remove_prefix(1);
        const std::string prefix = where.empty() ? "" : where + ".";
        if (name == "{}") {
            for (const auto& [member, inner] : value.items()) check(inner, rule, rest, prefix + member);
            return;
        }
        const auto member = value.find(name);
        if (member != value.end()) check(*member, rule, rest, prefix + name);
    }

    void checkValue(const Json& value, const GltfRule& rule, const std::string& where) {
        using enum RuleKind;
        switch (rule.kind) {
            case Index:
                return checkIndex(value, rule.of, where);
            case Count:
                if (!value.is_number_unsigned()) fail(where, "a whole number of 0 or more", value);
                if (rule.size > 0 && value.get<std::uint64_t>() >= rule.size)
                    fail(where, "a whole number of 0 to " + std::to_string(rule.size - 1), value);
                return;
            case Number:
            case Positive:
            case Unit:
                if (!value.is_number()) fail(where, "a number", value);
                if (rule.kind == Positive && value.get<double>() < 0)
                    doubt(where, "0 or more", value, "the nearest is taken");
                if (rule.kind == Unit && !isUnit(value))
                    doubt(where, "0 to 1", value, "the nearest is taken");
                return;
            case Numbers:
            case Positives:
            case Units:
            case Quaternion:
                if (!value.is_array() || value.size() != rule.size ||
                    !std::ranges::all_of(value, [](const Json& v) { return v.is_number(); }))
                    fail(where, std::to_string(rule.size) + " numbers", value);
                if (rule.kind == Positives &&
                    !std::ranges::all_of(value, [](const Json& v) { return v.get<double>() >= 0; }))
                    doubt(where, "numbers of 0 or more", value, "the nearest are taken");
                if (rule.kind == Units && !std::ranges::all_of(value, isUnit))
                    doubt(where, "numbers from 0 to 1", value, "the nearest are taken");
                if (rule.kind == Quaternion && !hasUnitLength(value))
                    doubt(where, "a quaternion of length 1", value, "it is normalised");
                return;
            case String:
                if (!value.is_string()) fail(where, "a string", value);
                return;
            case Word:
                if (!value.is_string()) fail(where, "a string", value);
                if (const auto words = split(rule.of, ' ');
                    std::ranges::find(words, value.get<std::string>()) == words.end())
                    fail(where, "one of " + listed(words), value);
                return;
            case Bool:
                if (!value.is_boolean()) fail(where, "true or false", value);
                return;
            case Object:
                if (!value.is_object()) fail(where, "an object", value);
        }
    }

    void checkIndex(const Json& value, std::string_view array, const std::string& where) const {
        const std::string noun = singular(array);
        const bool vowel = noun[0] == 'a' || noun[0] == 'i';
        if (!value.is_number_unsigned())
            fail(where, (vowel ? "the number of an " : "the number of a ") + noun + ", 0 or more", value);
        std::string pointer = "/" + std::string(array);
        std::ranges::replace(pointer, '.', '/');
        const Json::json_pointer place(pointer);
        const std::size_t there =
            root_.contains(place) && root_.at(place).is_array() ? root_.at(place).size() : 0;
        if (value.get<std::uint64_t>() >= there)
            throw Error(file_, where + " refers to " + noun + " " +
                                   std::to_string(value.get<std::uint64_t>()) + ", the file has " +
                                   std::to_string(there));
    }

    void checkTextures() {
        const auto materials = root_.find("materials");
        if (materials == root_.end()) return;
        for (std::size_t i = 0; i < materials->size(); ++i)
            checkTexturesIn((*materials)[i], "materials[" + std::to_string(i) + "]");
    }

    void checkTexturesIn(const Json& object, const std::string& where) {
        if (!object.is_object()) fail(where, "an object", object);
        for (const auto& [name, member] : object.items()) {
            const std::string place = where + "." + name;
            if (name.ends_with("Texture")) {
                if (!member.is_object()) fail(place, "an object", member);
                if (!member.contains("index")) fail(place, "the index of a texture", member);
                for (const GltfRule& rule : gltfTextureRules()) check(member, rule, rule.place, place);
            } else if (name == "pbrMetallicRoughness") {
                checkTexturesIn(member, place);
            } else if (name == "extensions") {
                if (!member.is_object()) fail(place, "an object", member);
                for (const auto& [extension, inner] : member.items())
                    if (isSupported(extension)) checkTexturesIn(inner, place + "." + extension);
            }
        }
    }

    /// Compressed data whose plain form is left out, though nothing requires the extension.
    void checkCompressed() const {
        const auto each = [&](const char* array, const auto& visit) {
            if (const auto found = root_.find(array); found != root_.end())
                for (std::size_t i = 0; i < found->size(); ++i)
                    visit((*found)[i], std::string(array) + "[" + std::to_string(i) + "]");
        };
        each("buffers", [&](const Json& buffer, const std::string& where) {
            const std::string extension = "KHR_meshopt_compression";
            if (buffer.contains("extensions") && buffer["extensions"].contains(extension) &&
                !buffer.contains("uri"))
                throw Error(file_, where + " has data only in the extension " + extension +
                                       ", which is not supported" + remedyFor(extension));
        });
    }

    const std::string& file_;
    const Json& root_;
    std::vector<std::string> warnings_;
    std::size_t unlisted_ = 0;
};

}  // namespace

GltfFacts checkGltf(const std::string& file, const std::string& text) {
    if (isNestedTooDeep(text))
        throw Error(file, "expected arrays and objects in each other up to " + std::to_string(kDeepest) +
                              " deep, found deeper ones");
    try {
        const Json root = Json::parse(text);
        Checker checker(file, root);
        checker.check();
        GltfFacts facts{checker.warnings(), {}};
        for (const Json& camera : root.value("cameras", Json::array()))
            facts.zeroAspects.push_back(camera.value("/perspective/aspectRatio"_json_pointer, 1.0) == 0);
        return facts;
    } catch (const Json::parse_error& e) {
        throw Error(file, "expected a glTF file, found no JSON at byte " + std::to_string(e.byte));
    } catch (const Json::out_of_range& e) {
        throw Error(file, std::string("expected numbers that fit into 64 bits: ") + e.what());
    }
}

}  // namespace vlx::render
