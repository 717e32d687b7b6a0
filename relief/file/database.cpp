#include <relief/base/atomic_file.h>
#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/file/database.h>

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <random>
#include <string>
#include <thread>
#include <utility>

namespace relief::detail {

namespace fs = std::filesystem;

namespace {

constexpr int kBusyMilliseconds = 2000;
constexpr int kStepsBetweenLooks = 4096;  // of SQLite's machine between two looks whether it should stop: about 0.1 ms
constexpr int kPagesPerCopy = 1024;       // of a database between two looks: about 10 ms
constexpr const char* kCancelled = "stays as it was: the work was cancelled";

std::string place_of(const fs::path& file) { return printable(file.string()) + ": "; }

std::string not_a(const FileKind& kind) { return "is not a " + std::string(kind.suffix) + " file"; }

std::string foreign_tables(const FileKind& kind) {
  return "its tables are not those of a " + std::string(kind.suffix) + " file";
}

/// Returns the sentence for a result code of SQLite.
Error failure_of(const OpenFile& file, int code, int system_error) {
  const auto error = [&](Errc errc, const std::string& what) { return Error{errc, place_of(file.name) + what}; };
  if (code == SQLITE_READONLY_ROLLBACK || code == SQLITE_READONLY_RECOVERY)
    return error(Errc::Io,
                 "holds an unfinished change that must be undone first: make its folder writable or copy the file "
                 "together with its -journal to one");
  if (code == SQLITE_READONLY_DBMOVED) return error(Errc::Io, "was replaced by another program: open it again");
  switch (code & 0xff) {
    case SQLITE_NOTADB:
      return error(Errc::UnsupportedFormat, not_a(*file.kind));
    case SQLITE_CORRUPT:
      return error(Errc::Corrupt, "is damaged: its tables cannot be read");
    case SQLITE_INTERRUPT:
      return error(Errc::Cancelled, kCancelled);
    case SQLITE_FULL:
      return error(Errc::Io, "cannot grow, the disk is full: nothing that was finished before is lost");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return error(Errc::Io, "is in use by another program: close it there first");
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return error(Errc::Io, "cannot be written: it or its folder is read-only");
    case SQLITE_TOOBIG:
      return error(Errc::Io, "cannot hold a part that large");
    case SQLITE_CANTOPEN:
    case SQLITE_IOERR:
      return error(Errc::Io, std::string(code == SQLITE_CANTOPEN ? "cannot be read" : "cannot be read or written") +
                                 (system_error != 0 ? std::string(": ") + std::strerror(system_error) : ""));
    default:
      return error(Errc::Io, std::string("cannot be used: ") + sqlite3_errstr(code));
  }
}

std::unexpected<Error> io(const fs::path& file, const char* what, int system_error) {
  return fail(Errc::Io, place_of(file) + what + ": " + std::strerror(system_error));
}

/// Nothing that a file says may run: no triggers, views or functions from its schema, and no statement of unusual size.
void harden(sqlite3* handle) {
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, kBusyMilliseconds);
  for (const auto& [option, value] :
       std::initializer_list<std::pair<int, int>>{{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                                  {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                                  {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                                  {SQLITE_DBCONFIG_ENABLE_VIEW, 0},
                                                  {SQLITE_DBCONFIG_ENABLE_LOAD_EXTENSION, 0}})
    sqlite3_db_config(handle, option, value, nullptr);
  for (const auto& [limit, value] : std::initializer_list<std::pair<int, int>>{{SQLITE_LIMIT_LENGTH, 1 << 28},
                                                                               {SQLITE_LIMIT_SQL_LENGTH, 10000},
                                                                               {SQLITE_LIMIT_COLUMN, 64},
                                                                               {SQLITE_LIMIT_EXPR_DEPTH, 30},
                                                                               {SQLITE_LIMIT_COMPOUND_SELECT, 3},
                                                                               {SQLITE_LIMIT_ATTACHED, 0},
                                                                               {SQLITE_LIMIT_TRIGGER_DEPTH, 1}})
    sqlite3_limit(handle, limit, value);
}

/// While it lives, each page that a database reads from its file is a step of `progress`, which can interrupt the
/// statement that runs. SQLite's check of b-trees asks no progress handler, but it reads through here.
class PageWatch {
 public:
  PageWatch(sqlite3* handle, const Progress& progress, std::uint64_t pages) noexcept
      : handle_(handle), steps_(progress, "open", pages) {
    sqlite3_file* file = nullptr;
    constexpr int kKnownVersion = 3;  // of the methods, as far as our header names them
    if (sqlite3_file_control(handle, "main", SQLITE_FCNTL_FILE_POINTER, static_cast<void*>(&file)) != SQLITE_OK ||
        file == nullptr || file->pMethods == nullptr || file->pMethods->iVersion < kKnownVersion)
      return;
    file_ = file;
    original_ = file->pMethods;
    static_cast<sqlite3_io_methods&>(methods_) = *original_;
    methods_.iVersion = kKnownVersion;
    methods_.xRead = &PageWatch::read;
    methods_.watch = this;
    file->pMethods = &methods_;
  }
  PageWatch(const PageWatch&) = delete;
  PageWatch& operator=(const PageWatch&) = delete;
  ~PageWatch() {
    if (file_ != nullptr) file_->pMethods = original_;
  }
  [[nodiscard]] bool stopped() const noexcept { return steps_.stopped(); }

 private:
  struct Methods : sqlite3_io_methods {
    PageWatch* watch;
  };
  static int read(sqlite3_file* file, void* to, int size, sqlite3_int64 at) {
    PageWatch& watch = *static_cast<const Methods*>(file->pMethods)->watch;
    if (!watch.steps_.next()) sqlite3_interrupt(watch.handle_);
    return watch.original_->xRead(file, to, size, at);
  }

  sqlite3* handle_;
  Steps steps_;
  sqlite3_file* file_ = nullptr;
  const sqlite3_io_methods* original_ = nullptr;
  Methods methods_{};
};

}  // namespace

// ---- Statement

void Statement::Finalize::operator()(sqlite3_stmt* statement) const noexcept { sqlite3_finalize(statement); }

Statement& Statement::bind(std::int64_t value) {
  if (const int rc = sqlite3_bind_int64(statement_.get(), ++parameter_, value); rc != SQLITE_OK) bind_error_ = rc;
  return *this;
}
Statement& Statement::bind(double value) {
  if (const int rc = sqlite3_bind_double(statement_.get(), ++parameter_, value); rc != SQLITE_OK) bind_error_ = rc;
  return *this;
}
Statement& Statement::bind(std::string_view value) {
  const char* bytes = value.empty() ? "" : value.data();
  const int rc = sqlite3_bind_text64(statement_.get(), ++parameter_, bytes, value.size(), SQLITE_STATIC, SQLITE_UTF8);
  if (rc != SQLITE_OK) bind_error_ = rc;
  return *this;
}
Statement& Statement::bind(std::span<const std::byte> value) {
  const void* bytes = value.empty() ? "" : static_cast<const void*>(value.data());  // a null pointer would mean NULL
  const int rc = sqlite3_bind_blob64(statement_.get(), ++parameter_, bytes, value.size(), SQLITE_STATIC);
  if (rc != SQLITE_OK) bind_error_ = rc;
  return *this;
}

Result<bool> Statement::step() {
  const int rc = bind_error_ != SQLITE_OK ? bind_error_ : sqlite3_step(statement_.get());
  if (rc == SQLITE_ROW) return true;
  if (rc == SQLITE_DONE) return false;
  return std::unexpected(failure_of(*file_, rc, sqlite3_system_errno(sqlite3_db_handle(statement_.get()))));
}

Status Statement::run() {
  for (;;) {
    RELIEF_TRY(const bool row, step());
    if (!row) return {};
  }
}

void Statement::reset() noexcept {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
  parameter_ = 0;
  bind_error_ = SQLITE_OK;
}

Statement::Type Statement::type(int column) const noexcept {
  switch (sqlite3_column_type(statement_.get(), column)) {
    case SQLITE_INTEGER:
      return Type::Integer;
    case SQLITE_FLOAT:
      return Type::Real;
    case SQLITE_TEXT:
      return Type::Text;
    case SQLITE_BLOB:
      return Type::Blob;
    default:
      return Type::Null;
  }
}
std::int64_t Statement::integer(int column) const noexcept { return sqlite3_column_int64(statement_.get(), column); }
double Statement::real(int column) const noexcept { return sqlite3_column_double(statement_.get(), column); }
std::string_view Statement::text(int column) const noexcept {
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return bytes == nullptr ? std::string_view() : std::string_view(bytes, static_cast<std::size_t>(size));
}
std::span<const std::byte> Statement::blob(int column) const noexcept {
  const auto* bytes = static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return bytes == nullptr ? std::span<const std::byte>() : std::span(bytes, static_cast<std::size_t>(size));
}

// ---- Database

void Database::Close::operator()(sqlite3* handle) const noexcept { sqlite3_close_v2(handle); }

Result<Database> Database::open(const fs::path& place, Access access, const FileKind& kind, const fs::path& named) {
  const fs::path& file = named.empty() ? place : named;
  std::error_code code;
  const fs::file_status status = fs::status(place, code);
  if (status.type() == fs::file_type::not_found) return fail(Errc::NotFound, place_of(file) + "no such file");
  if (status.type() == fs::file_type::none) return io(file, "cannot be read", code.value());
  if (status.type() == fs::file_type::directory) return fail(Errc::Io, place_of(file) + "is a folder");
  if (status.type() != fs::file_type::regular) return fail(Errc::Io, place_of(file) + "is not a regular file");
  // An absolute path is never taken for a URI.
  const fs::path absolute = fs::absolute(place, code);
  if (code) return io(file, "cannot be found", code.value());

  const auto connect = [&](int flags) -> Result<Database> {
    sqlite3* handle = nullptr;
    const int rc = sqlite3_open_v2(absolute.c_str(), &handle, flags | SQLITE_OPEN_FULLMUTEX, nullptr);
    Database database;
    database.file_ = std::make_unique<OpenFile>(OpenFile{file, &kind});
    database.handle_.reset(handle);
    if (rc != SQLITE_OK)
      return std::unexpected(failure_of(*database.file_, rc, handle != nullptr ? sqlite3_system_errno(handle) : 0));
    harden(handle);
    RELIEF_CHECK(database.run("PRAGMA cell_size_check = ON"));
    return database;
  };
  RELIEF_TRY(Database database, connect(access == Access::Write ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY));
  if (access == Access::Write) {
    if (sqlite3_db_readonly(database.handle_.get(), "main") != 0)
      return std::unexpected(failure_of(*database.file_, SQLITE_READONLY, 0));
    return database;
  }
  if (access == Access::Damaged) {
    // Only with these two does SQLite read a file that is shorter than its header says.
    sqlite3_db_config(database.handle_.get(), SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
    sqlite3_db_config(database.handle_.get(), SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, nullptr);
  }
  // A reader cannot undo what a killed writer left, so a writer does it once.
  int rc = sqlite3_exec(database.handle_.get(), "PRAGMA schema_version", nullptr, nullptr, nullptr);
  if (rc == SQLITE_READONLY_ROLLBACK || rc == SQLITE_READONLY_RECOVERY || rc == SQLITE_CANTOPEN) {
    if (auto writer = connect(SQLITE_OPEN_READWRITE)) {
      const Status undone = writer->run("PRAGMA schema_version");
      if (!undone) return std::unexpected(undone.error());
      rc = sqlite3_exec(database.handle_.get(), "PRAGMA schema_version", nullptr, nullptr, nullptr);
    }
  }
  if (rc != SQLITE_OK && access != Access::Damaged)
    return std::unexpected(failure_of(*database.file_, rc, sqlite3_system_errno(database.handle_.get())));
  return database;
}

Result<Statement> Database::prepare(std::string_view sql) const {
  sqlite3_stmt* statement = nullptr;
  const int rc = sqlite3_prepare_v2(handle_.get(), sql.data(), static_cast<int>(sql.size()), &statement, nullptr);
  if (rc != SQLITE_OK) {
    // The SQL is ours and right, so a table or column that does not exist is the file's fault.
    if (rc == SQLITE_ERROR) return damaged(foreign_tables(*file_->kind));
    return std::unexpected(failure_of(*file_, rc, sqlite3_system_errno(handle_.get())));
  }
  Statement made;
  made.statement_.reset(statement);
  made.file_ = file_.get();
  return made;
}

Status Database::run(std::string_view sql) const {
  RELIEF_TRY(Statement statement, prepare(sql));
  return statement.run();
}

Result<std::int64_t> Database::integer(std::string_view sql) const {
  RELIEF_TRY(Statement statement, prepare(sql));
  RELIEF_TRY(const bool row, statement.step());
  return row ? statement.integer(0) : 0;
}

std::uint32_t Database::change_counter() const noexcept {
  constexpr sqlite3_int64 kOffset = 24;  // in the header of a database file, big-endian (sqlite.org/fileformat.html)
  sqlite3_file* file = nullptr;
  std::array<unsigned char, 4> b{};
  if (sqlite3_file_control(handle_.get(), "main", SQLITE_FCNTL_FILE_POINTER, static_cast<void*>(&file)) != SQLITE_OK ||
      file == nullptr || file->pMethods == nullptr ||
      file->pMethods->xRead(file, b.data(), static_cast<int>(b.size()), kOffset) != SQLITE_OK)
    return 0;
  return std::uint32_t{b[0]} << 24U | std::uint32_t{b[1]} << 16U | std::uint32_t{b[2]} << 8U | b[3];
}

bool Database::in_transaction() const noexcept { return sqlite3_get_autocommit(handle_.get()) == 0; }

Status Database::begin_reading() const {
  RELIEF_CHECK(run("BEGIN"));
  const Status locked = run("PRAGMA schema_version");  // the first read takes the lock
  if (!locked) roll_back();
  return locked;
}

void Database::roll_back() const noexcept {
  if (in_transaction()) sqlite3_exec(handle_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
}

Status Database::copy_from(const Database& other, const Progress& progress) const {
  RELIEF_CHECK(other.begin_reading());  // holds writers off from the first page to the last
  sqlite3_backup* backup = sqlite3_backup_init(handle_.get(), "main", other.handle_.get(), "main");
  int rc = backup == nullptr ? sqlite3_extended_errcode(handle_.get()) : SQLITE_OK;
  while (rc == SQLITE_OK && !progress.cancelled()) {
    rc = sqlite3_backup_step(backup, kPagesPerCopy);
    const int all = sqlite3_backup_pagecount(backup);
    if (rc == SQLITE_OK && all > 0) progress("copy", 1 - static_cast<double>(sqlite3_backup_remaining(backup)) / all);
  }
  sqlite3_backup_finish(backup);
  other.roll_back();
  if (rc == SQLITE_DONE) return {};
  if (rc == SQLITE_OK) return cancelled();
  const bool reading = (rc & 0xff) == SQLITE_CORRUPT || (rc & 0xff) == SQLITE_NOTADB || (rc & 0xff) == SQLITE_BUSY;
  return std::unexpected(failure_of(reading ? *other.file_ : *file_, rc, sqlite3_system_errno(handle_.get())));
}

Database::Cancellable::Cancellable(const Database& database, const Progress& progress) noexcept
    : handle_(database.handle_.get()) {
  if (progress.cancel == nullptr) return;
  const auto asks = [](void* cancel) {
    return static_cast<const std::atomic<bool>*>(cancel)->load(std::memory_order_relaxed) ? 1 : 0;
  };
  sqlite3_progress_handler(handle_, kStepsBetweenLooks, asks, const_cast<std::atomic<bool>*>(progress.cancel));
}
Database::Cancellable::~Cancellable() { sqlite3_progress_handler(handle_, 0, nullptr, nullptr); }

Status Database::write_tables() const {
  for (const FileKind::Table& table : file_->kind->tables) RELIEF_CHECK(run(table.definition));
  RELIEF_CHECK(run("PRAGMA application_id = " + std::to_string(file_->kind->application_id)));
  return run("PRAGMA user_version = " + std::to_string(file_->kind->newest_format));
}

Status Database::check_format() const {
  RELIEF_TRY(const std::int64_t application, integer("PRAGMA application_id"));
  if (application != file_->kind->application_id) return failure(Errc::UnsupportedFormat, not_a(*file_->kind));
  RELIEF_TRY(const std::int64_t format, integer("PRAGMA user_version"));
  if (format > file_->kind->newest_format)
    return failure(Errc::NewerVersion, "was written by a newer program (format " + std::to_string(format) +
                                           ", this one reads up to " + std::to_string(file_->kind->newest_format) +
                                           "): update Relief");
  if (format < 1) return damaged("its format version is " + std::to_string(format));
  return {};
}

Status Database::check_definitions() const {
  const auto& wanted = file_->kind->tables;
  RELIEF_TRY(Statement tables,
             prepare("SELECT name, sql FROM sqlite_schema WHERE name NOT LIKE 'sqlite~_%' ESCAPE '~'"));
  std::size_t known = 0;
  for (;; ++known) {
    RELIEF_TRY(const bool row, tables.step());
    if (!row) break;
    const auto same = [&](const FileKind::Table& table) {
      return table.name == tables.text(0) && table.definition == tables.text(1);
    };
    if (std::none_of(wanted.begin(), wanted.end(), same)) return damaged(foreign_tables(*file_->kind));
  }
  return known == wanted.size() ? Status() : damaged("it lacks a table");
}

Status Database::check_tables(const Progress& progress) const {
  RELIEF_CHECK(check_definitions());
  RELIEF_TRY(const std::int64_t pages, integer("PRAGMA page_count"));
  RELIEF_TRY(Statement check, prepare("PRAGMA integrity_check(1)"));
  const PageWatch watch(handle_.get(), progress, static_cast<std::uint64_t>(pages));
  const Result<bool> checked = check.step();
  if (watch.stopped()) return cancelled();
  RELIEF_TRY(const bool row, checked);
  if (!row || check.text(0) != "ok") return damaged("its tables contradict themselves");
  return {};
}

std::unexpected<Error> Database::failure(Errc code, std::string_view what) const {
  return fail(code, place_of(file_->name) + std::string(what));
}

std::unexpected<Error> Database::damaged(std::string_view what) const {
  return failure(Errc::Corrupt, "is damaged: " + std::string(what));
}

std::unexpected<Error> Database::cancelled() const { return failure(Errc::Cancelled, kCancelled); }

// ---- Replacement

namespace {

constexpr std::string_view kSuffix = ".tmp";
constexpr std::size_t kDigits = 16;

/// Removes NAME.<16 digits>.tmp beside the target where their writer is dead. A writer holds a lock from right after it
/// made the file, so an unlocked one of some age has none.
void remove_leftovers(const fs::path& target) {
  const std::string prefix = target.filename().string() + ".";
  std::error_code code;
  for (fs::directory_iterator at(target.parent_path(), code), end; !code && at != end; at.increment(code)) {
    const std::string name = at->path().filename().string();
    if (name.size() != prefix.size() + kDigits + kSuffix.size() || !name.starts_with(prefix) ||
        !name.ends_with(kSuffix) ||
        name.find_first_not_of("0123456789abcdef", prefix.size()) != name.size() - kSuffix.size())
      continue;
    const int descriptor = ::open(at->path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) continue;
    struct stat status{};
    const bool old = ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
                     std::chrono::system_clock::now() - std::chrono::system_clock::from_time_t(status.st_mtime) >
                         std::chrono::minutes(1);
    if (old && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0) ::unlink(at->path().c_str());
    ::close(descriptor);
  }
}

/// The folder of a file, held by one replacer at a time, so that none opens the old file while another puts the new one
/// in its place. Where the folder is not available within the time that we wait for a database, nothing is held.
class Folder {
 public:
  explicit Folder(const fs::path& file)
      : descriptor_(::open(file.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    for (int waited = 0; descriptor_ >= 0 && waited < kBusyMilliseconds; waited += 10) {
      if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  /// 0, or the error of the system.
  [[nodiscard]] int sync() const noexcept {
    return descriptor_ < 0 || ::fsync(descriptor_) == 0 || errno == EINVAL ? 0 : errno;
  }

 private:
  int descriptor_;
};

fs::path beside(const fs::path& file, const char* suffix) { return fs::path(file.string() + suffix); }

}  // namespace

Result<Replacement> Replacement::make(const fs::path& target, const FileKind& kind) {
  std::error_code code;
  Replacement made;
  made.kind_ = &kind;
  made.target_ = fs::absolute(target, code);
  if (code) return io(target, "cannot be written", code.value());
  made.target_ = behind_links(made.target_);
  const fs::file_status status = fs::status(made.target_, code);
  if (status.type() == fs::file_type::directory || made.target_.filename().empty())
    return fail(Errc::Io, place_of(target) + "is a folder");
  if (status.type() != fs::file_type::regular && status.type() != fs::file_type::not_found)
    return fail(Errc::Io, place_of(target) + "cannot be written: it is not a regular file");
  remove_leftovers(made.target_);

  std::random_device random;
  for (int attempt = 0; attempt < 16; ++attempt) {
    std::string name = made.target_.string() + ".";
    for (std::size_t k = 0; k < kDigits; ++k) name += "0123456789abcdef"[random() % 16];
    name += kSuffix;
    made.descriptor_ = ::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (made.descriptor_ < 0 && errno == EEXIST) continue;
    if (made.descriptor_ < 0) return io(target, "cannot be written", errno);
    made.file_ = name;
    ::flock(made.descriptor_, LOCK_EX | LOCK_NB);
    struct stat old{};
    if (::stat(made.target_.c_str(), &old) == 0) (void)::fchmod(made.descriptor_, old.st_mode & 07777U);
    return made;
  }
  return io(target, "cannot be written", EEXIST);
}

Replacement::Replacement(Replacement&& other) noexcept
    : target_(std::move(other.target_)),
      file_(std::move(other.file_)),
      kind_(other.kind_),
      descriptor_(std::exchange(other.descriptor_, -1)) {
  other.file_.clear();
}

Replacement::~Replacement() {
  if (!file_.empty()) ::unlink(file_.c_str());
  if (descriptor_ >= 0) ::close(descriptor_);
}

/// The danger is a journal of the old file: SQLite finds it by its name alone, and would roll old pages back
/// into the new file. So the old file is brought to rest first (opening it applies and removes its journal), then held
/// locked, so that no other process can start a change, until the new one has its name. A journal beside no database
/// belongs to nothing. Killed at any moment, this leaves the old file whole or the new one whole.
Status Replacement::replace_target() {
  if (::fsync(descriptor_) != 0) return io(target_, "cannot be written", errno);
  const Folder folder(target_);
  std::error_code code;
  Result<Database> old = Database::open(target_, Database::Access::Write, *kind_);
  bool orphaned = false;
  if (old) {
    Status locked = old->run("PRAGMA journal_mode = DELETE");
    if (locked) locked = old->run("BEGIN EXCLUSIVE");
    if (!locked) {
      if (locked.error().code != Errc::UnsupportedFormat && locked.error().code != Errc::Corrupt) return locked;
      orphaned = true;
    }
  } else {
    if (old.error().code != Errc::NotFound) return std::unexpected(old.error());
    orphaned = true;
  }
  for (const char* suffix : {"-journal", "-wal", "-shm"}) {
    const fs::path journal = beside(target_, suffix);
    if (!orphaned && !fs::exists(journal, code)) continue;
    if (::unlink(journal.c_str()) != 0 && errno != ENOENT) return io(journal, "is in the way", errno);
  }
  if (::rename(file_.c_str(), target_.c_str()) != 0) return io(target_, "cannot be replaced", errno);
  file_.clear();
  if (const int error = folder.sync(); error != 0) return io(target_, "cannot be written", error);
  return {};
}

}  // namespace relief::detail
