// The relief command line: one function per command, all with the same frame around them.
#pragma once

#include "help.h"

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/core/model.h>
#include <relief/edit/editor.h>
#include <relief/file/model_file.h>
#include <relief/file/recording.h>
#include <relief/haptics/servo.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace relief::cli {

/// What every command shares. A command's options write into objects that live as long as the program; parsing it sets
/// `run`.
struct Context {
  bool json = false;
  bool quiet = false;           ///< nothing but errors, and JSON where that is asked for
  bool progress_lines = false;  ///< a line per phase where standard error is no terminal
  int threads = 0;              ///< 0: as many as the machine has
  Progress progress;
  std::function<Status()> run;
  Catalogue catalogue;  ///< what the commands say of themselves
};

/// While it lives, the command has written nothing: where the work does not answer a Ctrl-C within a second, the
/// program ends. One at a time.
class NothingWritten {
 public:
  NothingWritten();
  ~NothingWritten();
  NothingWritten(const NothingWritten&) = delete;
  NothingWritten& operator=(const NothingWritten&) = delete;
};

/// Which of the options that commands share one has.
struct SharedOptions {
  bool json = true;
  bool work = true;  ///< --quiet, --progress and --threads
};
/// Adds the shared options, and makes `action` what is run when the command is chosen.
void finish_command(CLI::App& command, Context& context, std::function<Status()> action, SharedOptions shared = {});

/// The names of all commands, in the order in which they were added.
[[nodiscard]] std::vector<std::string> command_names(const CLI::App& app);
/// "; the nearest is convert", or nothing where no word is like the text.
[[nodiscard]] std::string nearest_of(std::string_view text, const std::vector<std::string>& words);
/// Adds what failed to the JSON of a command: error.code, .message, .file (null where none is to blame) and
/// .exit_status. Nothing where nothing failed.
void add_error(nlohmann::ordered_json& json, const Status& ended);

/// What `info` says of a file that is a mesh: what came in, and what of it was passed over.
[[nodiscard]] Status run_mesh_info(const std::string& file, const Context& context);

void add_convert(CLI::App& app, Context& context);
/// After add_convert(), of which it takes the options of a conversion.
void add_batch(CLI::App& app, Context& context);
void add_verify(CLI::App& app, Context& context);
void add_info(CLI::App& app, Context& context);
void add_undo(CLI::App& app, Context& context);
void add_refine(CLI::App& app, Context& context);
void add_touch(CLI::App& app, Context& context);
void add_sculpt(CLI::App& app, Context& context);
void add_render(CLI::App& app, Context& context);
void add_export(CLI::App& app, Context& context);
void add_sample(CLI::App& app, Context& context);
void add_bench(CLI::App& app, Context& context);
void add_studio(CLI::App& app, Context& context);
void add_devices(CLI::App& app, Context& context);
void add_replay(CLI::App& app, Context& context);
void add_help(CLI::App& app, Context& context);
void add_completion(CLI::App& app, Context& context);

/// --stiffness, --damping, --friction, --static-friction, --max-force, --exact-normals, --paper-contact, --guard and
/// --no-guard.
void add_force_options(CLI::App& command, ForceSettings& force);
/// Whether one of the last two is given.
[[nodiscard]] bool names_guard(const CLI::App& command);
/// Refuses a ball that is too large or too small for a model. Error: InvalidArgument.
[[nodiscard]] Status check_tool_radius(double radius, const Model& model, std::string_view name,
                                       std::string_view said = "--tool-radius");
/// "a ball of radius 2".
[[nodiscard]] std::string tool_name(double radius, std::size_t points);
/// The names of the flags that are set.
[[nodiscard]] std::vector<std::string> flag_names(std::uint32_t flags);
/// "a, b, c".
[[nodiscard]] std::string joined(const std::vector<std::string>& words, std::string_view between = ", ");
/// A line that says how much of a recording is whole where its end is missing; empty where it is not.
[[nodiscard]] std::string missing_end(const Recording& recording);
/// Checks for options that are real or whole numbers from low to high, or one of some words. What they describe is in
/// the help: the range, the words.
[[nodiscard]] CLI::Validator in_range(double low, double high);
[[nodiscard]] CLI::Validator whole_in_range(long low, long high);
[[nodiscard]] CLI::Validator one_of(std::vector<std::string> choices);

/// Refuses, before any work is done, an output that is one of the inputs or another output, a folder, or in a folder
/// that is not there or is read-only. Empty names are skipped. Errors: InvalidArgument, Io.
[[nodiscard]] Status check_outputs(std::initializer_list<std::string_view> outputs,
                                   std::initializer_list<std::string_view> inputs);

/// Refuses a file that holds strokes, or may hold them, for it cannot be read, or is of another kind: what it holds
/// would be lost. Error: InvalidArgument.
[[nodiscard]] Status check_strokes(const std::string& out, bool force, const Progress& progress);
/// An output that is not a model.
struct OtherOutput {
  std::string_view file;       ///< empty: not asked for
  std::string_view kind;       ///< "forces"
  std::string_view extension;  ///< that such files usually have
};
/// Ends the command as wrong usage: what the words of the command line are at fault for, whatever the files hold.
/// Throws CLI::ValidationError, which may leave a command's action.
[[noreturn]] void refuse_usage(const std::string& message);
/// Refuses to write such an output under the name of a model (.relief), also through a link; see refuse_usage().
void check_no_model(std::initializer_list<OtherOutput> outputs);
/// Refuses to write a model under another name than NAME.relief, unless it is changed in place; see refuse_usage().
void check_model_name(const std::string& out, const std::string& in = {});
/// Whether a file, or what a link leads to, has the name of a model.
[[nodiscard]] bool names_model(std::string_view file);
/// Opens a model and warns on standard error where it has a doubt(). Errors: those of ModelFile::open(), Cancelled.
[[nodiscard]] Result<ModelFile> open_model(const std::string& file, const Context& context, bool read_only = true);
/// The warning alone, for a model that was opened otherwise. Error: Cancelled.
[[nodiscard]] Status warn_of_doubt(const std::string& file, const ModelFile& model, const Context& context);

/// A check for options that name a file: not empty.
[[nodiscard]] std::string names_file(const std::string& file);
/// Whether `file` has one of the extensions, whatever their case; the form that an option's check takes.
[[nodiscard]] std::function<std::string(const std::string&)> has_extension(std::vector<std::string_view> extensions);

/// Writes a warning on standard error, one line without "relief: warning: "; not with --quiet.
void warn(std::string_view text);
/// Text for standard output. A closed pipe is no error; any other failure makes the command fail at its end.
void print(std::string_view text);
void print_json(const nlohmann::ordered_json& object);
/// Returns its three coordinates as an array.
[[nodiscard]] nlohmann::ordered_json vector_json(Vec3d v);

/// "x,y,z". Error: InvalidArgument naming the option.
[[nodiscard]] Result<Vec3d> parse_vector(std::string_view option, std::string_view text);

/// One row of a path: a device reading in model units, and its first four fields as they were written.
struct PathRow {
  double t = 0;
  Vec3d position;
  std::optional<Quatd> orientation;
  std::string text;  ///< "t,x,y,z"
};
/// Reads a path file (header t,x,y,z or t,x,y,z,qw,qx,qy,qz). Numbers may be nan or inf. Errors name the file and the
/// line.
[[nodiscard]] Result<std::vector<PathRow>> read_path(const std::filesystem::path& file);
/// Reads the points of a rigid tool (header x,y,z), model units, in the tool's frame: 1 to TouchTool::kMostPoints.
/// Errors name the file and the line.
[[nodiscard]] Result<std::vector<Vec3d>> read_tool_points(const std::filesystem::path& file);
/// The whole file, at most `limit` bytes. Errors name the file: NotFound, Io.
[[nodiscard]] Result<std::string> read_text(const std::filesystem::path& file, std::uintmax_t limit);

}  // namespace relief::cli
