// The picture of the model, and the hand on it.
#pragma once

#include "camera_control.h"
#include "overlays.h"
#include "render_thread.h"
#include "stroke_input.h"

#include <QBasicTimer>
#include <QElapsedTimer>
#include <QTimer>
#include <QWidget>
#include <optional>

class QNativeGestureEvent;
class QTouchEvent;

namespace relief::studio {

/// Which buttons and keys turn the camera (see docs/reference/studio.md).
enum class NavigationMap : std::uint8_t { Blender, Industry, Pen };

/// Shows pictures that a render thread draws: while nothing changes, nothing is drawn.
class Viewport : public QWidget {
  Q_OBJECT
 public:
  Viewport(DocumentBridge& bridge, ToolState& tools, QWidget* parent = nullptr);
  ~Viewport() override;

  /// Another model or scan; the camera frames it where `frame_it` says so.
  void set_scene(Scene scene, Unit unit, bool frame_it);
  [[nodiscard]] const Scene& scene() const { return scene_; }
  /// Another snapshot of the same model; what changed lies in it.
  void set_model(SnapshotPtr model);

  [[nodiscard]] const Camera& camera() const { return camera_; }
  void set_camera(const Camera& camera);
  void frame_all();
  /// The axis of the model that points up in the picture, y or z; turns the camera to its front.
  void set_up(Vec3d up);
  [[nodiscard]] Vec3d up() const { return up_; }
  /// What the picture becomes when nothing moves any more.
  [[nodiscard]] Frame final_frame() const;
  [[nodiscard]] const Look& look() const { return look_; }
  void set_look(const Look& look);
  /// Pixels beside the left edge, for something that lies over the picture there: the legend stands right of them.
  /// Pictures for files have nothing over them.
  void keep_left_free(int pixels);
  /// Draws all of the picture again; it must be the same.
  void redraw_everything();

  void set_map(NavigationMap map) { map_ = map; }
  [[nodiscard]] NavigationMap map() const { return map_; }
  /// Whether one finger on the model sculpts; else it turns the camera, as beside the model.
  void set_touch_sculpts(bool sculpts) { touch_sculpts_ = sculpts; }
  void set_turntable(bool turntable) { turntable_ = turntable; }
  [[nodiscard]] bool turntable() const { return turntable_; }
  /// Whether a hand strokes, turns or sets something here now.
  [[nodiscard]] bool busy() const { return gesture_ != Gesture::None; }
  /// Frames per second at most; 30 leaves a core to a servo where the driver draws with the CPU.
  void set_beside_servo(bool beside) { beside_servo_ = beside; }
  /// The samples of a pixel when the picture has been still for long; 16 unless somebody set less.
  void set_final_samples(int samples) { final_samples_ = samples; }
  /// Motion events that the last stroke took.
  [[nodiscard]] int stroke_events() const { return stroke_.events(); }
  /// Overlays that others own and keep; painted in their order over those of the viewport.
  void add_overlay(const Overlay* overlay);
  /// Off: nothing is painted over the picture.
  void show_overlays(bool shown);
  /// Call when an overlay shows something else than before.
  void update_overlays();
  /// The next click picks the colour under the pointer.
  void pick_colour();
  /// Makes a stroke of the pointer once more; says why not where that is not possible.
  void repeat_stroke(const PointerStroke& stroke);
  /// Begins the drag that sets a length or share of the brush: "radius" or "strength".
  void begin_drag(const QString& setting);

  [[nodiscard]] const QString& device() const { return device_; }
  [[nodiscard]] OverlayView overlay_view() const;
  /// Where the ring is in the window's pixels; empty where it is not.
  [[nodiscard]] QRect ring_in_window() const;
  /// Model units: of the dab that the pointer makes, or would make; 0 where there is no ring.
  [[nodiscard]] double ring_radius() const { return ring_.place ? ring_.radius : 0; }
  [[nodiscard]] const QImage& picture() const { return picture_; }
  /// What the pointer hits on the surface.
  [[nodiscard]] std::optional<RayHit> hit(QPointF at) const;
  [[nodiscard]] Ray3d ray(QPointF at) const;

  [[nodiscard]] Unit unit() const { return unit_; }
  /// Diagonal of what is shown, model units.
  [[nodiscard]] double extent() const { return diagonal_; }

 signals:
  /// Another scene is shown; its camera is already set.
  void sceneChanged();
  void cameraChanged();
  /// A pen's name and pressure, 0..1; or an empty name for the mouse.
  void pointerKnown(const QString& name, double pressure, double tilt);
  void colourPicked(relief::Vec3f colour);
  /// What people should know, as a toast.
  void said(const QString& words);
  void frameDrawn(quint64 number);
  /// The picture is the final one.
  void settled();
  /// The driver's name, and whether it draws with the CPU.
  void deviceKnown(const QString& name, bool software);
  /// By the pointer or the keys, and not cancelled.
  void strokeMade(const relief::studio::PointerStroke& stroke);
  /// The pointer, also while it draws a stroke; the wheel while Touch is pressed: for the force probe.
  void pointed(const relief::Ray3d& ray, bool pressed, double pressure);
  void left();
  /// By a tap of three fingers.
  void undoAsked();
  void depthTurned(double notches);
  /// Files were dropped here.
  void dropped(const QStringList& files);

 protected:
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void keyReleaseEvent(QKeyEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;
  void enterEvent(QEnterEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dropEvent(QDropEvent* event) override;
  void timerEvent(QTimerEvent* event) override;
  bool event(QEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  enum class Gesture : std::uint8_t { None, Stroke, Orbit, Pan, Zoom, Drag, Touch };
  [[nodiscard]] Gesture gesture_for(Qt::MouseButton button, Qt::KeyboardModifiers modifiers, bool on_model) const;
  void press(Gesture gesture, const PointerSample& sample, Qt::KeyboardModifiers modifiers, bool eraser);
  void move(const PointerSample& sample);
  void release();
  bool tablet(QTabletEvent* event);
  bool taps_twice(const PointerSample& sample);
  bool touch(QTouchEvent* event);
  bool trackpad(QNativeGestureEvent* event);
  void navigate(QPointF by);
  void drag_setting(QPointF at);
  void end_drag(bool keep);
  void look_from(Axis axis);
  void move_ring_by_keys(QKeyEvent* event);
  void dab_at_ring();
  void end_stroke();

  void changed(qint64 input_ns);
  void ask();
  void ask_now();
  void take(Piece piece);
  void update_ring();
  void describe(bool drawing);
  void use_theme();
  void pace(const Piece& piece);
  void log_camera(const Camera& camera);
  /// ms between two pictures at least: 125 in a second, 30 where servo and driver share the CPU.
  [[nodiscard]] qint64 interval_ms() const { return software_ && beside_servo_ ? 33 : 8; }
  [[nodiscard]] double pixel_ratio() const { return devicePixelRatioF(); }
  [[nodiscard]] bool has_scene() const { return scene_.model || scene_.mesh; }

  DocumentBridge& bridge_;
  ToolState& tools_;
  StrokeInput stroke_;
  Scene scene_;
  Unit unit_ = Unit::Millimetre;
  Box3d box_;
  double diagonal_ = 1;
  Vec3d up_ = {0, 1, 0};
  Camera camera_, logged_;
  Look look_;
  int left_free_ = 0;
  NavigationMap map_ = NavigationMap::Blender;
  bool turntable_ = true, space_ = false, pick_ = false, pen_down_ = false;
  bool touch_sculpts_ = false, touch_moved_ = false;
  qsizetype most_fingers_ = 0;
  QElapsedTimer touch_clock_;
  QString device_;
  bool software_ = false, beside_servo_ = false;
  int final_samples_ = 16;

  Gesture gesture_ = Gesture::None;
  Qt::MouseButton button_ = Qt::NoButton;
  QPointF pointer_, last_;
  std::optional<double>
      pen_;  ///< pressure of the pen that is near or draws; none where a mouse or a key was heard last
  std::optional<PointerSample> pen_tap_;  ///< where and when a pen came down last, if that was beside the model
  bool over_ = false;
  QString drag_;
  double drag_from_ = 0;
  QPointF drag_at_;

  QImage picture_;
  std::uint64_t frames_ = 0;
  bool wanted_ = false, moving_ = false, everything_ = false, in_flight_ = false, refining_ = false;
  Stage stage_ = Stage::Quick;
  int coarser_ = 0;  ///< halvings of the level while something happens, beyond what is usual; 0 or 1
  int slow_ = 0;     ///< pictures in a row that took too long
  qint64 input_ns_ = 0;
  QElapsedTimer clock_, since_asked_;
  QTimer ask_timer_, rest_timer_, ring_timer_;
  QBasicTimer hold_timer_;

  RingOverlay ring_;
  PillOverlay info_, drag_value_;
  AxisOverlay axes_;
  PlaneOverlay planes_;
  std::vector<const Overlay*> others_;
  bool overlays_ = true;
  QRegion painted_;
  mutable PickHint hint_;
  RenderThread thread_;
};

}  // namespace relief::studio
