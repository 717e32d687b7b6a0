#include "hand_sound.h"

#include <QAudioDevice>
#include <QAudioFormat>
#include <QAudioSink>
#include <QCoreApplication>
#include <QMediaDevices>
#include <algorithm>
#include <cmath>
#include <cstring>

namespace relief::studio {

namespace {

/// ms of sound that wait at the loudspeaker: longer than the window is ever busy, shorter than a lag one hears.
constexpr int kBuffer = 60;

}  // namespace

HandSound::HandSound() { open(QIODevice::ReadOnly | QIODevice::Unbuffered); }

HandSound::~HandSound() {
  if (sink_) sink_->stop();
}

void HandSound::set_on(bool on) {
  on_ = on;
  apply();
}

void HandSound::run(bool session) {
  session_ = session;
  apply();
}

void HandSound::apply() {
  const bool wanted = on_ && session_;
  if (wanted == (sink_ != nullptr)) return;
  if (!wanted) {
    playing_ = false;
    sink_->stop();
    sink_.reset();
    return;
  }
  trouble_.clear();
  const QAudioDevice speaker = QMediaDevices::defaultAudioOutput();
  QAudioFormat format;
  format.setSampleRate(ContactSound::kRate);
  format.setChannelCount(1);
  format.setSampleFormat(QAudioFormat::Float);
  as_float_ = speaker.isFormatSupported(format);
  if (!as_float_) format.setSampleFormat(QAudioFormat::Int16);
  if (speaker.isNull() || !speaker.isFormatSupported(format)) {
    trouble_ = QCoreApplication::translate("HandSound", "No loudspeaker was found.");
    return;
  }
  sink_ = std::make_unique<QAudioSink>(speaker, format);
  sink_->setBufferSize(format.bytesForDuration(kBuffer * 1000));
  sink_->start(this);
  if (sink_->error() != QAudio::NoError) {
    trouble_ = QCoreApplication::translate("HandSound", "The loudspeaker could not be opened.");
    sink_.reset();
    return;
  }
  playing_ = true;
}

qint64 HandSound::bytesAvailable() const {
  return QIODevice::bytesAvailable() + (as_float_ ? 4 : 2) * ContactSound::kRate;
}

qint64 HandSound::readData(char* data, qint64 most) {
  const auto size = as_float_ ? sizeof(float) : sizeof(std::int16_t);
  samples_.resize(static_cast<std::size_t>(std::max<qint64>(most, 0)) / size);
  synthesis_.render(samples_);
  if (as_float_) {
    std::memcpy(data, samples_.data(), samples_.size() * size);
  } else {
    for (std::size_t k = 0; k < samples_.size(); ++k) {
      const auto sample = static_cast<std::int16_t>(std::lround(samples_[k] * 32767.0F));
      std::memcpy(data + k * size, &sample, size);
    }
  }
  return static_cast<qint64>(samples_.size() * size);
}

}  // namespace relief::studio
