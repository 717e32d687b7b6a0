// What a kiosk is made of, and how it begins.
#include "background.h"
#include "event_log.h"
#include "kiosk.h"
#include "kiosk_choose.h"
#include "kiosk_stage.h"
#include "picture_of.h"
#include "text.h"
#include "widgets/theme.h"

#include <relief/base/try.h>

#include <QApplication>
#include <QLabel>
#include <QLineEdit>
#include <QVBoxLayout>
#include <cstdio>

namespace relief::studio {

namespace {

QImage to_image(const Picture& picture) {
  return QImage(picture.rgb.data(), picture.width, picture.height, 3 * picture.width, QImage::Format_RGB888).copy();
}

}  // namespace

/// What lies over the pages: words on a model that turns or is being opened, the countdown, the field for the code.
void Kiosk::build_covers() {
  cover_ = new QWidget(this);
  cover_->setObjectName(QStringLiteral("kiosk-cover"));
  auto* column = new QVBoxLayout(cover_);
  column->setContentsMargins(scaled(60), scaled(60), scaled(60), scaled(60));
  cover_title_ = new QLabel(cover_);
  cover_title_->setFont(ui_font(34, QFont::DemiBold));
  cover_words_ = new QLabel(cover_);
  cover_words_->setFont(ui_font(20));
  column->addWidget(cover_title_);
  column->addStretch(1);
  column->addWidget(cover_words_, 0, Qt::AlignHCenter);
  for (QLabel* label : {cover_title_, cover_words_}) {
    label->setTextFormat(Qt::PlainText);
    label->setStyleSheet(
        QStringLiteral("color: white; background: rgba(0, 0, 0, 110); border-radius: 10px; padding: 10px 18px;"));
  }
  column->setAlignment(cover_title_, Qt::AlignLeft);
  const auto frame = [this](const QString& id) {
    auto* made = new QFrame(this);
    made->setObjectName(id);
    made->setProperty("role", QStringLiteral("card"));
    made->hide();
    auto* lines = new QVBoxLayout(made);
    lines->setContentsMargins(scaled(44), scaled(36), scaled(44), scaled(36));
    return made;
  };
  count_ = frame(QStringLiteral("kiosk-countdown"));
  count_words_ = new QLabel(count_);
  count_words_->setFont(ui_font(26, QFont::DemiBold));
  count_words_->setAlignment(Qt::AlignCenter);
  count_->layout()->addWidget(count_words_);
  code_frame_ = frame(QStringLiteral("kiosk-code"));
  code_line_ = new QLineEdit(code_frame_);
  code_line_->setObjectName(QStringLiteral("kiosk-code-line"));
  code_line_->setEchoMode(QLineEdit::Password);
  code_line_->setContextMenuPolicy(Qt::NoContextMenu);
  code_line_->setMaxLength(64);
  code_line_->setMinimumWidth(scaled(260));
  code_frame_->layout()->addWidget(code_line_);
  connect(code_line_, &QLineEdit::returnPressed, this, &Kiosk::check_code);
}

/// The picture of each model, one after the other, on workers.
void Kiosk::draw_pictures() {
  const QSize size = choose_->picture_size() * devicePixelRatioF();
  for (std::size_t k = 0; k < exhibits_.size(); ++k) {
    auto picture = std::make_shared<QImage>();
    in_background(
        this,
        [from = exhibits_[k].model, look = stage_->viewport().look(), size, picture]() -> Status {
          RELIEF_TRY(const ModelFile original, ModelFile::open(path(from), true));
          Frame frame;
          frame.width = size.width();
          frame.height = size.height();
          frame.samples = 4;
          frame.look = look;
          frame.camera = framing(*original.model().head, 20, 15, size.width() / double(size.height()));
          RELIEF_TRY(const Picture drawn, draw_picture(*original.model().head, frame));
          *picture = to_image(drawn);
          return {};
        },
        [this, k, picture](const Status& status) {
          if (status)
            choose_->set_picture(k, *picture);
          else
            log_.write(QStringLiteral("no picture: ") + text(status.error().message));
        });
  }
}

int run_kiosk(QApplication& application, const QStringList& models_or_folders, const QSettings& settings,
              const QString& language, const QString& device) {
  Result<std::vector<Exhibit>> exhibits = read_exhibits(models_or_folders);
  if (!exhibits) {
    std::fprintf(stderr, "relief studio: %s\n", exhibits.error().message.c_str());
    return 1;
  }
  event_log().write(QStringLiteral("start"), {{"pid", QCoreApplication::applicationPid()}});
  Kiosk kiosk(std::move(*exhibits), settings, language, device);
  kiosk.showFullScreen();
  kiosk.activateWindow();
  return application.exec();
}

}  // namespace relief::studio
