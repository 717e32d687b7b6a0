#include <relief/base/try.h>
#include <relief/mesh/read/face_paint.h>
#include <relief/mesh/read/readers.h>

#include <cctype>
#include <optional>

namespace relief::detail {
namespace {

bool equals_word(std::string_view text, std::string_view word) noexcept {
  if (text.size() != word.size()) return false;
  for (std::size_t k = 0; k < text.size(); ++k)
    if (std::tolower(static_cast<unsigned char>(text[k])) != word[k]) return false;
  return true;
}

enum class Word : std::uint8_t { Other, Colour, Solid, Facet, Outer, Vertex, EndLoop, EndFacet, EndSolid };

/// Takes a word, or two where "end" stands apart. What lines it breaks says nothing: some programs write no line ends.
Word take_word(TextCursor& text) noexcept {
  static constexpr std::array<std::pair<std::string_view, Word>, 8> kWords = {{{"vertex", Word::Vertex},
                                                                               {"color", Word::Colour},
                                                                               {"facet", Word::Facet},
                                                                               {"outer", Word::Outer},
                                                                               {"endloop", Word::EndLoop},
                                                                               {"endfacet", Word::EndFacet},
                                                                               {"solid", Word::Solid},
                                                                               {"endsolid", Word::EndSolid}}};
  const std::string_view word = text.word();
  for (const auto& [name, known] : kWords)
    if (equals_word(word, name)) return known;
  if (!equals_word(word, "end")) return Word::Other;
  TextCursor ahead = text;
  const std::string_view what = ahead.word();
  const Word ended = equals_word(what, "loop")    ? Word::EndLoop
                     : equals_word(what, "facet") ? Word::EndFacet
                                                  : Word::EndSolid;
  if (ended != Word::EndSolid || equals_word(what, "solid")) text = ahead;
  return ended;
}

/// Over the name of a solid: to the end of the line, or to `next` where the file goes on in the same line.
void skip_name(TextCursor& text, std::string_view next) noexcept {
  TextCursor ahead = text;
  for (TextCursor before = ahead;; before = ahead) {
    const std::string_view word = ahead.word();
    if (word.empty()) break;
    if (!equals_word(word, next)) continue;
    text = before;
    return;
  }
  text.next_line();
}

class TextReader {
 public:
  explicit TextReader(const Source& source) : source_(source), text_(source.bytes) {}

  Result<TriangleMesh> read() {
    Steps steps = source_.steps(source_.bytes.size());
    while (text_.skip_to_value()) {
      if (!steps.reached(source_.bytes.size() - text_.left())) return source_.cancelled();
      const std::size_t line = text_.line();
      switch (take_word(text_)) {
        case Word::Solid:
          in_solid_ = true;
          skip_name(text_, "facet");
          break;
        case Word::EndSolid:
          in_solid_ = false;
          skip_name(text_, "solid");
          break;
        case Word::Facet:
          in_facet_ = true;
          break;
        case Word::EndFacet:
          in_facet_ = false;
          break;
        case Word::Outer:
          if (in_loop_) return source_.corrupt("line", line, "a loop starts inside another");
          in_loop_ = true;
          vertices_ = 0;
          break;
        case Word::Vertex:
          RELIEF_CHECK(read_vertex(line));
          break;
        case Word::EndLoop:
          RELIEF_CHECK(end_loop(line));
          break;
        case Word::Colour:
          has_colours_ = true;
          break;
        case Word::Other:  // facet normals
          break;
      }
    }
    if (in_loop_ || in_facet_) return source_.corrupt("the file ends inside a facet; it is cut off");
    if (mesh_.triangles.empty()) return source_.error(Errc::UnsupportedFormat, "holds no facets");
    if (in_solid_)
      mesh_.notes.push_back("it ends without endsolid, as a file does that was cut off; its " +
                            std::to_string(mesh_.triangles.size()) + " facets are whole");
    if (has_colours_)
      mesh_.notes.emplace_back("colours between its facets (color) are not part of STL and were passed over");
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] Status read_vertex(std::size_t line) {
    if (!in_loop_) return source_.corrupt("line", line, "a vertex stands outside a loop");
    Vec3d p;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!text_.skip_to_value() || !text_.number(p[axis]))
        return source_.corrupt("line", text_.line(), "a vertex needs three numbers, but there is " + text_.peek());
    }
    if (double more = 0.0; !text_.at_line_end() && text_.number(more))
      return source_.corrupt("line", line, "a vertex has more than three numbers");
    mesh_.positions.push_back(p);
    ++vertices_;
    return {};
  }

  [[nodiscard]] Status end_loop(std::size_t line) {
    if (!in_loop_ || vertices_ != 3)
      return source_.corrupt("line", line, "a facet has " + std::to_string(vertices_) + " vertices instead of three");
    if (mesh_.positions.size() > 0xfffffffeU) return source_.error(Errc::UnsupportedFormat, "has too many facets");
    const auto last = static_cast<std::uint32_t>(mesh_.positions.size() - 1);
    mesh_.triangles.push_back({last - 2, last - 1, last});
    in_loop_ = false;
    // Some leave the end of a facet out, and one that stands there has nothing left to say.
    in_facet_ = false;
    return {};
  }

  const Source& source_;
  TextCursor text_;
  TriangleMesh mesh_;
  std::size_t vertices_ = 0;  ///< of the loop
  bool in_solid_ = false, in_facet_ = false, in_loop_ = false, has_colours_ = false;
};

constexpr std::size_t kHead = 84;   ///< bytes before the first facet: 80 of any text, the count
constexpr std::size_t kFacet = 50;  ///< bytes: a normal, three corners, 16 bits that some use for a colour

/// Returns how many facets to read. The file's size rules where it is that of whole facets: programs that write as they
/// go put zero, or the count of an earlier part, into the header.
Result<std::size_t> facet_count(const Source& source, std::vector<std::string>& notes) {
  const std::string_view bytes = source.bytes;
  if (bytes.size() < kHead) return source.corrupt("is neither a text STL nor long enough for a binary one");
  const std::size_t declared = load_le<std::uint32_t>(bytes.data() + kHead - 4);
  const std::size_t room = (bytes.size() - kHead) / kFacet;
  const auto note_rest = [&](const std::string& holds) {
    if (const std::size_t rest = bytes.size() - kHead - declared * kFacet; rest > 0)
      notes.push_back("it " + holds + std::to_string(rest) + (rest == 1 ? " byte" : " bytes") +
                      " more, which were passed over");
  };
  if (declared == room) {
    note_rest("holds " + std::to_string(room) + " triangles as a binary STL, and ");
    return declared;
  }
  const std::string says = "declares " + std::to_string(declared) + " triangles as a binary STL, ";
  const bool whole = (bytes.size() - kHead) % kFacet == 0;
  // Text that only has the name of an STL may have such a size, too; numbers have bytes that no text has.
  const bool numbers = std::ranges::any_of(bytes.substr(kHead), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x80 || byte < '\t' || (byte > '\r' && byte < ' ');
  });
  if (whole && room > 0 && numbers) {
    notes.push_back("it " + says + "and its size is that of " + std::to_string(room) + ", which were read");
    return room;
  }
  if (declared > room) return source.corrupt(says + "but has room for " + std::to_string(room) + "; it is cut off");
  if (declared > 0) note_rest(says + "and holds ");
  return declared;
}

/// The colours that facets have in 16 bits, five of them for each channel, in one of two dialects.
class FacetColours {
 public:
  explicit FacetColours(std::string_view head) : materials_(1), palette_(materials_) {
    constexpr std::string_view kMagics = "COLOR=";
    const std::size_t at = head.substr(0, kHead - 4).find(kMagics);
    if (at == std::string_view::npos || at + kMagics.size() + 4 > kHead - 4) return;
    const auto byte = [&](std::size_t k) { return static_cast<std::uint8_t>(head[at + kMagics.size() + k]); };
    general_ = Rgba8{byte(0), byte(1), byte(2)};
  }

  /// Magics names a colour of the whole in the header; a facet with bit 15 has that one, others have their own, red
  /// lowest. In the dialect of VisCAM and SolidView a facet with bit 15 has its own colour, blue lowest.
  void add(std::uint16_t bits) {
    any_ = any_ || bits != 0;
    const bool flag = (bits & 0x8000U) != 0;
    flagged_ = flagged_ || flag;
    if (material_of_.empty()) first_ = bits;
    differ_ = differ_ || bits != first_;
    const auto channel = [&](unsigned shift) {
      return static_cast<std::uint8_t>((((bits >> shift) & 31U) * 255U + 15U) / 31U);
    };
    Rgba8 colour;
    if (general_) {
      colour = flag ? *general_ : Rgba8{channel(0), channel(5), channel(10)};
    } else if (flag) {
      colour = {channel(10), channel(5), channel(0)};
    }
    material_of_.push_back(palette_.number_of(colour));
  }

  void dress(TriangleMesh& mesh) {
    // A header with a colour and no facet that says anything: the whole has that one.
    if (general_ && !any_) std::ranges::fill(material_of_, palette_.number_of(*general_));
    // The same in all is what fills the place.
    if (!general_ && differ_ && !flagged_)
      mesh.notes.emplace_back("values of its facets that are no colours were passed over");
    if (one_grey(material_of_, materials_)) return;
    mesh.materials = std::move(materials_);
    mesh.material_of = std::move(material_of_);
  }

 private:
  std::optional<Rgba8> general_;
  std::vector<Material> materials_;
  Palette palette_;
  std::vector<std::uint32_t> material_of_;
  std::uint16_t first_ = 0;
  bool any_ = false, differ_ = false, flagged_ = false;
};

}  // namespace

Result<TriangleMesh> read_stl_text(const Source& source) { return TextReader(source).read(); }

Result<TriangleMesh> read_stl_binary(const Source& source) {
  TriangleMesh mesh;
  RELIEF_TRY(const std::size_t count, facet_count(source, mesh.notes));
  if (count == 0) return source.error(Errc::UnsupportedFormat, "holds no triangles");
  if (count > 0x55555554U) return source.error(Errc::UnsupportedFormat, "has too many triangles");
  mesh.positions.reserve(count * 3);
  mesh.triangles.reserve(count);
  FacetColours colours(source.bytes);
  const char* at = source.bytes.data() + kHead;
  Steps steps = source.steps(count);
  for (std::size_t k = 0; k < count; ++k, at += kFacet) {
    if (!steps.next()) return source.cancelled();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const char* p = at + 12 + 12 * corner;
      mesh.positions.push_back(to_double(Vec3f{load_le<float>(p), load_le<float>(p + 4), load_le<float>(p + 8)}));
    }
    const auto first = static_cast<std::uint32_t>(3 * k);
    mesh.triangles.push_back({first, first + 1, first + 2});
    colours.add(load_le<std::uint16_t>(at + kFacet - 2));
  }
  colours.dress(mesh);
  return mesh;
}

}  // namespace relief::detail
