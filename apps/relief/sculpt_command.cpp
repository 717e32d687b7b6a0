// sculpt: strokes from a file, or of a hand at a device, one transaction each.
#include "live.h"

#include <relief/base/place.h>
#include <relief/base/try.h>
#include <relief/convert/room.h>
#include <relief/session/document.h>
#include <relief/session/stroke_text.h>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

namespace relief::cli {

namespace {

using nlohmann::ordered_json;

/// Strokes that may be finished and not on the disk yet; more would only fill the memory.
constexpr std::uint64_t kUnsaved = 8;

struct SculptOptions : LiveOptions {
  std::string strokes, out;
  bool force = false, resume = false;
  std::string tool;
  std::map<std::string, std::string> settings;  ///< by id, as they were written
  std::string mirror;
  double full_force = 1.5;  ///< N
};

// ---- What a document tells

/// Room under all strokes that were played.
struct RoomTold {
  RoomEnded sum;           ///< fibres moved in all; of the stroke that lacked most, what and why
  int times = 0;           ///< how often room was made or could not be
  std::size_t stroke = 0;  ///< that stroke, from 1 on; 0: none lacked any
};

class Listener {
 public:
  /// `before`: strokes of the file that were played before.
  explicit Listener(std::size_t before = 0) : before_(before) {}
  [[nodiscard]] std::function<void(const Event&)> sink() {
    return [this](const Event& event) {
      const std::scoped_lock lock(mutex_);
      if (const auto* finished = std::get_if<StrokeFinished>(&event)) {
        strokes_.push_back(*finished);
        // What an attempt lacked is of no matter where the stroke did without, or a later one gave it.
        if (RoomEnded& sum = room_.sum; finished->result.limited > 0 && latest_.lacking > sum.lacking) {
          sum.lacking = latest_.lacking;
          sum.bar = latest_.bar;
          sum.bar_distance = latest_.bar_distance;
          sum.bar_at = latest_.bar_at;
          room_.stroke = before_ + strokes_.size();
        }
        latest_ = {};
      }
      if (const auto* failed = std::get_if<Failed>(&event)) failure_ = failed->error;
      if (const auto* room = std::get_if<RoomEnded>(&event)) {
        room_.sum.fibres += room->fibres;
        room_.sum.surface_moved = std::max(room_.sum.surface_moved, room->surface_moved);
        latest_ = *room;
        ++room_.times;
      }
      if (const auto* progressed = std::get_if<Progressed>(&event)) share_ = progressed->share;
      changed_.notify_all();
    };
  }
  /// Waits for the end of stroke `number` (from 0), or for a failure, 20 ms at most; whether it has come.
  [[nodiscard]] bool wait_for(std::size_t number) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::milliseconds(20),
                             [&] { return strokes_.size() > number || failure_.has_value(); });
  }
  [[nodiscard]] std::vector<StrokeFinished> strokes() const {
    const std::scoped_lock lock(mutex_);
    return strokes_;
  }
  [[nodiscard]] Status status() const {
    const std::scoped_lock lock(mutex_);
    return failure_ ? fail(failure_->code, failure_->message) : Status();
  }
  [[nodiscard]] RoomTold room() const {
    const std::scoped_lock lock(mutex_);
    return room_;
  }
  [[nodiscard]] double share() const {
    const std::scoped_lock lock(mutex_);
    return share_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<StrokeFinished> strokes_;
  std::optional<Error> failure_;
  double share_ = 0;
  std::size_t before_;
  RoomTold room_;
  RoomEnded latest_;  ///< of the stroke that is played
};

std::string_view name(RoomBar bar) {
  switch (bar) {
    case RoomBar::None:
      return "none";
    case RoomBar::FarSide:
      return "far_side";
    case RoomBar::OtherPart:
      return "other_part";
    case RoomBar::Fibres:
      return "fibres";
  }
  return {};
}

/// A place where something is so, or null.
ordered_json json_of(bool is_so, Vec3d place) { return is_so ? vector_json(place) : ordered_json(nullptr); }

ordered_json json_of(const RoomTold& room) {
  const RoomEnded& sum = room.sum;
  ordered_json json = {{"asked", room.times},    {"fibres", sum.fibres},
                       {"lacking", sum.lacking}, {"surface_moved", sum.surface_moved},
                       {"bar", name(sum.bar)},   {"bar_distance", sum.bar_distance}};
  json["bar_at"] = json_of(sum.bar != RoomBar::None, sum.bar_at);
  json["bar_stroke"] = sum.bar != RoomBar::None ? ordered_json(room.stroke) : ordered_json(nullptr);
  return json;
}

/// "stroke 2 near (1.5, -20, 0.25) mm".
std::string place_in(std::size_t stroke, Vec3d at, const ModelInfo& info) {
  const Vec3d p = rounded_place(at, info.source_diagonal);
  return fmt::format("stroke {0} near ({2:.{1}g}, {3:.{1}g}, {4:.{1}g}) {5}", stroke, kPlaceDigits, p.x, p.y, p.z,
                     name(info.unit));
}

/// Why a stroke could not go on, one sentence; empty where nothing barred its way.
std::string why_of(const RoomTold& room, const ModelInfo& info) {
  const std::string away = fmt::format("{:.3g} {}", room.sum.bar_distance, name(info.unit)),
                    place = place_in(room.stroke, room.sum.bar_at, info) + ": ";
  switch (room.sum.bar) {
    case RoomBar::None:
      return {};
    case RoomBar::FarSide:
      return place + "the form is " + away + " thick, and a stroke ends at half; carve beside it\n";
    case RoomBar::OtherPart:
      return place + "another part of the form is " + away + " away, and a stroke ends halfway to it\n";
    case RoomBar::Fibres:
      return place + "the form leaves no room for longer fibres\n";
  }
  return {};
}

/// What became of the slabs under the strokes; empty where all had room.
std::string said_of(const RoomTold& room, const ModelInfo& info) {
  const auto& [made, times, stroke] = room;
  if (times == 0 || (made.fibres == 0 && made.lacking == 0)) return {};
  std::string text = made.fibres == 0 ? "the clay ended under a stroke"
                                      : fmt::format("room was made: {} fibres reach further", made.fibres);
  if (made.surface_moved > 0)
    text += fmt::format(", and the surface beside the tool moved by {:.2g} {} at most", made.surface_moved,
                        name(info.unit));
  if (made.fibres > 0 && made.lacking > 0) text += fmt::format("; {} slabs still end early", made.lacking);
  return text + '\n' + why_of(room, info);
}

ordered_json json_of(const std::vector<StrokeFinished>& strokes) {
  ordered_json json = ordered_json::array();
  for (const StrokeFinished& s : strokes) {
    ordered_json stroke = {{"tool", name(s.tool)},
                           {"changed", s.result.changed},
                           {"samples", s.result.samples},
                           {"limited", s.result.limited},
                           {"missed", s.result.missed},
                           {"slabs_added", s.result.slabs_added},
                           {"samples_added", s.result.samples_added},
                           {"detail_limited", s.result.detail_limited},
                           {"beside", s.result.beside},
                           {"overhang", s.overhang},
                           {"folded", s.folded},
                           {"tiles", s.tiles},
                           {"seconds", s.seconds}};
    stroke["limited_at"] = json_of(s.result.limited > 0, s.result.limited_at);
    stroke["missed_at"] = json_of(s.result.missed > 0, s.result.missed_at);
    stroke["detail_limited_at"] = json_of(s.result.detail_limited, s.result.detail_limited_at);
    stroke["beside_at"] = json_of(s.result.beside, s.result.beside_at);
    stroke["overhang_at"] = json_of(s.overhang > 0, s.overhang_at);
    json.push_back(std::move(stroke));
  }
  return json;
}

std::string counted(std::uint64_t count, std::string_view what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// Something that strokes met, and where the first of them did.
struct Met {
  std::uint64_t count = 0;
  std::size_t stroke = 0;
  Vec3d at;
  void add(std::uint64_t more, std::size_t number, Vec3d place) {
    if (count == 0 && more > 0) {
      stroke = number;
      at = place;
    }
    count += more;
  }
};

/// What the strokes could not do, a line each; empty where they did all. The first has the number `first`.
std::string limits_of(const std::vector<StrokeFinished>& strokes, std::size_t first, const ModelInfo& info) {
  Met limited, missed, coarse, beside;
  std::uint64_t folded = 0;
  double overhang = 0;
  std::string over;
  for (std::size_t k = 0; k < strokes.size(); ++k) {
    const StrokeFinished& s = strokes[k];
    const std::size_t number = first + k;
    limited.add(s.result.limited, number, s.result.limited_at);
    missed.add(s.result.missed, number, s.result.missed_at);
    coarse.add(s.result.detail_limited ? 1 : 0, number, s.result.detail_limited_at);
    beside.add(s.result.beside ? 1 : 0, number, s.result.beside_at);
    if (s.overhang > overhang) {
      overhang = s.overhang;
      over = place_in(number, s.overhang_at, info);
    }
    folded += s.folded;
  }
  const auto first_of = [&](const Met& met) { return ", first in " + place_in(met.stroke, met.at, info); };
  std::vector<std::string> said;
  if (limited.count > 0)
    said.push_back(counted(limited.count, "sample") + " could not go as far as asked" + first_of(limited) +
                   ": the clay or the room above ends");
  if (missed.count > 0)
    said.push_back(counted(missed.count, "point") + " lay farther from the surface than the radius" + first_of(missed) +
                   ", and " + (missed.count == 1 ? "was" : "were") + " left out");
  if (coarse.count > 0)
    said.push_back("the grid stayed too coarse for " + counted(coarse.count, "stroke") + first_of(coarse) +
                   "; use a larger radius or detail");
  if (beside.count > 0)
    said.push_back("fibres lean under " + counted(beside.count, "stroke") + first_of(beside) +
                   ", so clay beside the tool was taken, too");
  if (overhang > 0)
    said.push_back(
        fmt::format("{} goes {:.3g} {} under the surface beside it; slabs hold no undercuts, so the clay above goes",
                    over, overhang, name(info.unit)));
  if (folded > 0) said.push_back("the fibres of " + counted(folded, "sample") + " meet the surface several times");
  std::string text;
  for (const std::string& line : said) text += line + '\n';
  return text;
}

/// `before`: strokes of the file that had been played already.
void say_strokes(const std::string& out, const std::vector<StrokeFinished>& strokes, std::size_t before,
                 std::uint64_t total, const ModelInfo& info) {
  const auto changed = std::ranges::count_if(strokes, [](const StrokeFinished& s) { return s.result.changed; });
  print(fmt::format("{}: {} of {} strokes changed the model; {} in all\n", printable(out), changed, strokes.size(),
                    total));
  print(limits_of(strokes, before + 1, info));
}

// ---- Strokes from a file

Result<std::vector<Stroke>> read_strokes(const std::string& file) {
  RELIEF_TRY(const std::string text, read_text(file, std::uintmax_t{1} << 30U));
  auto strokes = strokes_of(text, printable(file));
  if (!strokes && strokes.error().message.contains(": not JSON"))
    strokes.error().message += "; --strokes takes a strokes file (relief help strokes)";
  return strokes;
}

/// Whether a record of a journal is of this stroke.
bool is_of(const StrokeRecord& record, const Stroke& stroke) {
  const auto read = stroke_of(record.details, "journal");
  if (!read) return false;
  Stroke kept = *read, asked = stroke;
  kept.label = asked.label = {};
  return text_of(kept) == text_of(asked);
}

/// How many of the strokes the file has already, from the first on; its journal has `own` strokes that came before. A
/// stroke that changed nothing is in no journal: it is played again, on the model as it was then.
Result<std::size_t> strokes_in(const ModelFile& file, std::size_t own, const std::vector<Stroke>& strokes,
                               const Context& context) {
  RELIEF_TRY(const std::vector<StrokeRecord> journal, file.strokes());
  std::size_t done = 0;
  for (std::size_t k = own; k < file.stroke_count(); ++k, ++done) {
    for (; done < strokes.size() && !is_of(journal[k], strokes[done]); ++done) {
      RELIEF_TRY(SnapshotPtr then, file.at(k, context.progress));
      Editor editor(std::move(then));
      if (play(editor, strokes[done], context.progress).changed || context.progress.cancelled())
        return strokes.size() + 1;
    }
    if (done == strokes.size()) return strokes.size() + 1;
  }
  return done;
}

/// The same where OUT is a copy of MODEL, or MODEL itself: then its last strokes may be the first of these. Error:
/// InvalidArgument where they do not match.
Result<std::size_t> resume_at(const SculptOptions& o, const ModelFile& file, const std::vector<Stroke>& strokes,
                              const Context& context) {
  std::error_code ignored;
  if (std::filesystem::equivalent(o.model, o.out, ignored)) {
    const auto count = static_cast<std::size_t>(file.stroke_count());
    for (std::size_t own = count - std::min(count, strokes.size()); own < count; ++own) {
      RELIEF_TRY(const std::size_t done, strokes_in(file, own, strokes, context));
      if (done <= strokes.size()) return done;
    }
    return 0;
  }
  RELIEF_TRY(const ModelFile model, ModelFile::open(o.model, true, context.progress));
  RELIEF_TRY(const std::vector<StrokeRecord> before, model.strokes());
  RELIEF_TRY(const std::vector<StrokeRecord> journal, file.strokes());
  const auto own = static_cast<std::size_t>(model.stroke_count());
  const bool same_start =
      own <= file.stroke_count() && std::equal(before.begin(), before.begin() + static_cast<std::ptrdiff_t>(own),
                                               journal.begin(), [](const StrokeRecord& a, const StrokeRecord& b) {
                                                 return a.label == b.label && a.details == b.details;
                                               });
  if (same_start) {
    RELIEF_TRY(SnapshotPtr start, file.at(own, context.progress));
    if (start->content_hash() == model.model().head->content_hash()) {
      RELIEF_TRY(const std::size_t done, strokes_in(file, own, strokes, context));
      if (done <= strokes.size()) return done;
    }
  }
  if (context.progress.cancelled()) return fail(Errc::Cancelled, printable(o.out) + ": cancelled before any stroke");
  return fail(Errc::InvalidArgument,
              fmt::format("{}: does not hold the first strokes of {} on {}; --force instead of --resume replaces it",
                          printable(o.out), printable(o.strokes), printable(o.model)));
}

/// OUT as a model to sculpt, and how many of the strokes it has already.
Result<std::pair<ModelFile, std::size_t>> open_out(const SculptOptions& o, const std::vector<Stroke>& strokes,
                                                   const Context& context) {
  std::error_code ignored;
  const bool in_place = std::filesystem::equivalent(o.model, o.out, ignored);
  const bool resumes = o.resume && std::filesystem::exists(o.out, ignored);
  check_model_name(o.out, o.model);
  if (!in_place && !resumes) {
    if (const Status free = check_strokes(o.out, o.force, context.progress); !free)
      return fail(
          free.error().code,
          free.error().message + (o.strokes.empty() ? "" : ", or --resume to go on with those that are missing"));
    RELIEF_CHECK(ModelFile::copy(o.model, o.out, context.progress));
  }
  RELIEF_TRY(ModelFile file, open_model(o.out, context, false));
  std::size_t done = 0;
  if (resumes) {
    RELIEF_TRY(done, resume_at(o, file, strokes, context));
  }
  return std::pair(std::move(file), done);
}

Status play_all(Document& document, Listener& listener, const SculptOptions& o, std::span<const Stroke> strokes,
                const Context& context) {
  for (std::size_t k = 0; k < strokes.size(); ++k) {
    document.post(BeginStroke{.brush = strokes[k].brush, .tip = strokes[k].tip, .label = strokes[k].label});
    document.post(MoveStroke{.points = strokes[k].points});
    document.post(EndStroke{});
    while (!listener.wait_for(k)) {
      if (context.progress.cancelled()) document.post(CancelStroke{});
      context.progress("sculpt", (static_cast<double>(k) + listener.share()) / static_cast<double>(strokes.size()));
    }
    while (document.statistics().unsaved > kUnsaved && listener.status().has_value())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    RELIEF_CHECK(listener.status());
    if (context.progress.cancelled())
      return fail(Errc::Cancelled,
                  fmt::format("{}: cancelled after {} of {} strokes, which are saved", printable(o.out),
                              k + (listener.strokes().back().cancelled ? 0 : 1), strokes.size()));
  }
  return {};
}

Status run_strokes(const SculptOptions& o, const Context& context) {
  RELIEF_CHECK(check_outputs({o.out}, {o.strokes}));
  RELIEF_TRY(const std::vector<Stroke> strokes, read_strokes(o.strokes));
  RELIEF_TRY(auto opened, open_out(o, strokes, context));
  auto& [file, done] = opened;
  const std::size_t before = done;
  Listener listener(before);
  RoomMaker make_room = room_maker(file.model().info.source_diagonal);
  RELIEF_TRY(Document document,
             Document::open(o.out, std::move(file), {.on_event = listener.sink(), .make_room = std::move(make_room)}));
  Status ended = play_all(document, listener, o, std::span(strokes).subspan(before), context);
  const Status saved = document.close();
  const std::vector<StrokeFinished> told = listener.strokes();
  const std::uint64_t total = document.statistics().undo_steps;
  RELIEF_CHECK(ended);
  RELIEF_CHECK(saved);
  if (context.json) {
    ordered_json json;
    json["stroke_results"] = json_of(told);
    json["room"] = json_of(listener.room());
    if (o.resume) json["resumed_after"] = before;
    json["total"] = total;
    print_json(json);
    return {};
  }
  if (before > 0)
    print(fmt::format("{}: has the first {} of {} strokes already\n", printable(o.out), before, strokes.size()));
  if (!told.empty() || before == 0) say_strokes(o.out, told, before, total, document.info());
  print(said_of(listener.room(), document.info()));
  return {};
}

// ---- Live

Result<std::vector<double>> numbers_of(std::string_view option, std::string_view text, std::size_t count) {
  std::vector<double> numbers;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    double value = 0;
    const auto [stop, error] = std::from_chars(text.data() + at, text.data() + end, value);
    if (error != std::errc{} || stop != text.data() + end) break;
    numbers.push_back(value);
    at = end + 1;
    if (at > text.size() && numbers.size() == count) return numbers;
  }
  return fail(Errc::InvalidArgument, fmt::format("--{} takes {} numbers with commas between them, not \"{}\"", option,
                                                 count, printable(text, 40)));
}

/// Every setting that some tool has, once, in the order of the tools.
std::vector<SettingInfo> all_settings() {
  std::vector<SettingInfo> all;
  for (const ToolInfo& tool : tools())
    for (const SettingInfo& setting : tool.settings)
      if (std::ranges::find(all, setting.id, &SettingInfo::id) == all.end()) all.push_back(setting);
  return all;
}

std::string option_of(const SettingInfo& setting) {
  std::string option(setting.id);
  std::ranges::replace(option, '_', '-');
  return option;
}

/// One setting as it was written on the command line.
Status apply(Brush& brush, const SettingInfo& setting, const std::string& text) {
  const std::string option = option_of(setting);
  switch (setting.kind) {
    case SettingInfo::Kind::Value: {
      RELIEF_TRY(const std::vector<double> value, numbers_of(option, text, 1));
      set(brush, setting.id, value[0]);
      return {};
    }
    case SettingInfo::Kind::Switch:
      set(brush, setting.id, 1);
      return {};
    case SettingInfo::Kind::Choice: {
      const auto found = std::ranges::find(setting.choices, text);
      if (found == setting.choices.end()) {
        std::vector<std::string> known(setting.choices.begin(), setting.choices.end());
        return fail(Errc::InvalidArgument,
                    fmt::format("--{} takes one of {}, not \"{}\"", option, joined(known), printable(text, 40)));
      }
      set(brush, setting.id, static_cast<double>(found - setting.choices.begin()));
      return {};
    }
    case SettingInfo::Kind::Colour: {
      RELIEF_TRY(const std::vector<double> rgb, numbers_of(option, text, 3));
      brush.colour = to_float(Vec3d{rgb[0], rgb[1], rgb[2]} / 255.0);
      return {};
    }
    case SettingInfo::Kind::Curve: {
      RELIEF_TRY(const std::vector<double> curve, numbers_of(option, text, 3));
      brush.pressure = {.low = curve[0], .high = curve[1], .exponent = curve[2]};
      return {};
    }
  }
  return {};
}

/// The brush that the options ask for; a radius that they do not say is 3 % of the model's diagonal.
Result<Brush> brush_of(const SculptOptions& o, double diagonal) {
  const Tool tool = tool_from_name(o.tool).value_or(Tool::Carve);  // --tool takes no other name
  Brush brush{.tool = tool, .radius = 0.03 * diagonal};
  const ToolInfo& known = info(tool);
  for (const SettingInfo& setting : all_settings()) {
    const auto said = o.settings.find(std::string(setting.id));
    if (said == o.settings.end()) continue;
    if (std::ranges::find(known.settings, setting.id, &SettingInfo::id) == known.settings.end())
      return fail(Errc::InvalidArgument, fmt::format("--{} is no setting of {}", option_of(setting), known.id));
    RELIEF_CHECK(apply(brush, setting, said->second));
  }
  if (known.writes == Layer::Colour && !o.settings.contains("colour"))
    return fail(Errc::InvalidArgument, "--tool paint needs --colour R,G,B, three numbers 0..255");
  if (!o.mirror.empty()) {
    RELIEF_TRY(brush.mirror, parse_vector("--mirror", o.mirror));
  }
  RELIEF_CHECK(check(Stroke{.brush = brush, .label = {}, .points = {}}));
  return brush;
}

Status run_live(const SculptOptions& given, const Context& context) {
  SculptOptions o = given;
  if (o.out.empty()) o.out = o.model;
  RELIEF_CHECK(check_outputs({o.out, o.record}, {o.tool_points, played_recording(o)}));
  check_no_model({{o.record, "recordings", ".rlog"}});
  RELIEF_TRY(auto out, open_out(o, {}, context));
  ModelFile& file = out.first;
  RELIEF_TRY(const Brush brush, brush_of(o, diagonal(file.model().head->slab_mesh().bounds())));
  RELIEF_TRY(const OpenedDevice opened, open_named(o, file.model(), 1, context.progress));
  Session::Settings settings;
  settings.loss = o.loss;
  std::vector<Vec3d> points;
  RELIEF_TRY(settings.servo, settings_for(o, file, opened.workspace, opened.played, points));
  settings.sculpt.full_depth = o.full_force / settings.servo.force.stiffness / opened.workspace.metres_per_unit;
  if (opened.played && !context.json) say_played(o, *opened.played, settings.servo.tool);
  RELIEF_TRY(std::optional<Recorder> recorder,
             recorder_for(o, Recorder::Pace::Live, file, settings.servo, opened.device->info()));
  Listener listener;
  RoomMaker make_room = room_maker(file.model().info.source_diagonal);
  RELIEF_TRY(Document document,
             Document::open(o.out, std::move(file), {.on_event = listener.sink(), .make_room = std::move(make_room)}));
  Status ended;
  std::vector<OutputEnd> outputs;
  SessionStats stats;
  std::vector<DeviceLoss> losses;
  {
    Session session(*opened.device, document, settings, recorder ? &*recorder : nullptr);
    session.set_brush(brush);
    std::size_t told = 0;
    const double seconds = wait_for_end(session, o, context, "sculpt", told);
    const bool gone = !session.running() && !opened.device->ended();
    Status recorded = session.stop();
    stats = session.stats();
    losses = session.losses();
    if (!context.json) say_losses(losses, told);
    if (recorder) outputs.push_back(end_of(o, *recorder, std::move(recorded)));
    ended = end_of(outputs, context.progress.cancelled() ? fmt::format("stopped after {:.1f} s", seconds) : "");
    if (ended && gone) ended = device_lost(o, losses, stats.servo);
  }
  const Status saved = document.close();
  if (!saved) ended = saved;
  const std::vector<StrokeFinished> strokes = listener.strokes();
  const std::uint64_t total = document.statistics().undo_steps;
  const Summary summary = summary_of(stats);
  ordered_json json = to_json(summary);
  json["metres_per_unit"] = opened.workspace.metres_per_unit;
  json["stroke_results"] = json_of(strokes);
  json["room"] = json_of(listener.room());
  json["total"] = total;
  json["servo"] = to_json(stats.servo);
  json["losses"] = to_json(losses);
  json["outputs"] = to_json(outputs);
  add_error(json, ended);
  if (!context.json) say_strokes(o.out, strokes, 0, total, document.info());
  if (!context.json) print(said_of(listener.room(), document.info()));
  say_live(context, json, summary, stats.servo, outputs);
  return ended;
}

std::string help_of_tools() {
  std::string text = "Tools:\n";
  for (const ToolInfo& tool : tools()) text += fmt::format("  {:9} {}\n", tool.id, tool.help);
  return text;
}

/// "radius of carve, clay".
std::string meaning_of(const SettingInfo& setting) {
  std::vector<std::string> of;
  for (const ToolInfo& tool : tools())
    if (std::ranges::find(tool.settings, setting.id, &SettingInfo::id) != tool.settings.end()) of.emplace_back(tool.id);
  std::string text(setting.title);
  text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  constexpr std::size_t kFew = 3;  // more names than these fill the line
  if (of.size() <= kFew) text += " of " + joined(of);
  return text;
}

/// An option for each setting that some tool has.
void add_settings(CLI::App& c, SculptOptions& o, const std::string& section) {
  for (const SettingInfo& setting : all_settings()) {
    const std::string id(setting.id), option = "--" + option_of(setting), meaning = meaning_of(setting);
    const auto take = [&o, id](const std::string& text) { o.settings[id] = text; };
    const auto add = [&](const std::string& placeholder, const std::string& more) {
      return c.add_option_function<std::string>(option, take, meaning + more)->type_name(placeholder)->group(section);
    };
    switch (setting.kind) {
      case SettingInfo::Kind::Switch:
        c.add_flag_callback(option, [take] { take("1"); }, meaning)->group(section);
        break;
      case SettingInfo::Kind::Value:
        if (setting.unit == SettingInfo::Unit::Length)
          add("LENGTH", ", model units")->default_str(id == "radius" ? "3 % of the diagonal" : "0");
        else if (setting.unit == SettingInfo::Unit::Radii)
          add("SHARE", ", in radii; 0 leaves it as it is")
              ->default_str(fmt::format("1/{:.3g}", 1 / setting.preset))
              ->check(in_range(setting.min, setting.max));
        else
          add("SHARE", "")->default_str(fmt::format("{}", setting.preset))->check(in_range(setting.min, setting.max));
        break;
      case SettingInfo::Kind::Choice:
        add("NAME", "")
            ->check(one_of({setting.choices.begin(), setting.choices.end()}))
            ->default_str(std::string(setting.choices.front()));
        break;
      case SettingInfo::Kind::Colour:
        add("R,G,B", ", 0 to 255 each");
        break;
      case SettingInfo::Kind::Curve:
        add("LOW,HIGH,E", ": where the tool begins, where it works fully, exponent")->default_str("0,1,1");
        break;
    }
  }
}

}  // namespace

void add_sculpt(CLI::App& app, Context& context) {
  auto o = std::make_shared<SculptOptions>();
  CLI::App* c = app.add_subcommand("sculpt", "Play strokes on a model, or sculpt it live with a device");
  context.catalogue[c] = {
      .group = "Shape",
      .examples = {{"relief sculpt scan.relief --strokes face.json -o new.relief"},
                   {"relief sculpt scan.relief --strokes face.json -o new.relief --resume", "the missing strokes"},
                   {"relief sculpt scan.relief --device sim:hand --tool clay --radius 8 --seconds 5 -o new.relief"}},
      .notes =
          help_of_tools() + "\nThe strokes file: relief help strokes. Each stroke is written to OUT when it ends.\n"};
  c->add_option("MODEL", o->model, "the model")->required()->check(names_file);
  CLI::Option* strokes = c->add_option("--strokes", o->strokes, "play the strokes of this file")
                             ->check(names_file)
                             ->type_name("STROKES.json");
  c->add_option("-o,--output", o->out, "the model with the strokes; may be MODEL, and live is MODEL without it")
      ->check(names_file)
      ->type_name("OUT.relief");
  CLI::Option* force =
      c->add_flag("--force", o->force, "replace another model that has strokes, or a file that is not a model");
  c->add_flag("--resume", o->resume, "where OUT has the first of these strokes, continue with the others")
      ->needs(strokes)
      ->excludes(force);
  const std::string brush = "Brush, with --device";
  const std::vector<std::string_view> ids = tool_ids();
  c->add_option("--tool", o->tool, "what happens while the first button is down")
      ->check(one_of({ids.begin(), ids.end()}))
      ->type_name("TOOL")
      ->group(brush);
  add_settings(*c, *o, brush);
  c->add_option("--mirror", o->mirror, "a point on the planes of --symmetry")
      ->type_name("X,Y,Z")
      ->default_str("0,0,0")
      ->group(brush);
  c->add_option("--full-force", o->full_force, "the force that counts as pressure 1")
      ->check(in_range(0.01, 100))
      ->type_name("NEWTONS")
      ->default_str("1.5")
      ->group(brush);
  add_live_options(*c, *o);
  strokes->excludes("--device")->excludes("--tool");
  finish_command(*c, context,
                 [o, &context] { return o->strokes.empty() ? run_live(*o, context) : run_strokes(*o, context); });
  c->parse_complete_callback([o, c] {
    complete(*c, *o, true);
    if (!o->strokes.empty()) {
      if (o->out.empty()) throw CLI::ValidationError("sculpt --strokes needs -o OUT, which may be MODEL");
      if (!o->settings.empty() || !o->mirror.empty())
        throw CLI::ValidationError(
            "the settings of the tool are in the strokes file; options for them are for --device");
      return;
    }
    // Its radius may be left to the model; all else of the brush is on the command line.
    if (const auto wanted = brush_of(*o, 1); !wanted && !o->tool.empty()) refuse_usage(wanted.error().message);
    if (o->device.empty() || o->tool.empty() || (o->seconds == 0 && !o->device.starts_with(kReplayDevice)))
      throw CLI::ValidationError("sculpt needs --strokes S.json -o OUT, or --device NAME --tool T --seconds S");
  });
}

}  // namespace relief::cli
