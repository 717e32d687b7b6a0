// Plays the sound of a contact.
#pragma once

#include <relief/session/contact_sound.h>

#include <QIODevice>
#include <QString>
#include <atomic>
#include <memory>

class QAudioSink;

namespace relief::studio {

/// The loudspeaker's end of a ContactSound. A computer without one is no error: trouble() says it, and nothing plays.
class HandSound : public QIODevice {
 public:
  HandSound();
  ~HandSound() override;

  void set_on(bool on);
  [[nodiscard]] bool on() const { return on_; }
  [[nodiscard]] const QString& trouble() const { return trouble_; }
  /// Opens the loudspeaker while a session runs, closes it after.
  void run(bool session);

  /// A session's thread: whether ticks are wanted, and one of them.
  [[nodiscard]] bool wants() const { return playing_.load(std::memory_order_relaxed); }
  void tick(const SoundTick& tick) { synthesis_.tick(tick); }

  bool isSequential() const override { return true; }
  qint64 bytesAvailable() const override;

 protected:
  qint64 readData(char* data, qint64 most) override;
  qint64 writeData(const char*, qint64) override { return -1; }

 private:
  void apply();

  ContactSound synthesis_;
  bool on_ = false, session_ = false, as_float_ = true;
  std::atomic<bool> playing_{false};
  QString trouble_;
  std::vector<float> samples_;
  std::unique_ptr<QAudioSink> sink_;
};

}  // namespace relief::studio
