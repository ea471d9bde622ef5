// What people look at: visualization_msgs, diagnostic_msgs.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ros_common/messages/sensors.hpp"

namespace pointflight::msg {

/// A place in a texture.
struct UVCoordinate {
  static constexpr TypeName kType{"visualization_msgs", "UVCoordinate"};
  /// Shares of its width and height, 0 to 1.
  ///@{
  float u = 0.0f, v = 0.0f;
  ///@}
  template <class M, class V>
  static void fields(M& m, V& visitor) {
    visitor("u", m.u);
    visitor("v", m.v);
  }
};

/// A mesh inside a message: ROS 2 only, always empty here.
struct MeshFile {
  static constexpr TypeName kType{"visualization_msgs", "MeshFile"};
  std::string filename;            ///< With the extension that tells its format.
  std::vector<std::uint8_t> data;  ///< The file's bytes.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("filename", m.filename);
    v("data", m.data);
  }
};

/// A shape that RViz draws.
struct Marker {
  static constexpr TypeName kType{
      "visualization_msgs",
      "Marker",
      "visualization_msgs",
      "uint8 ARROW=0\nuint8 CUBE=1\nuint8 SPHERE=2\nuint8 CYLINDER=3\nuint8 LINE_STRIP=4\n"
      "uint8 LINE_LIST=5\nuint8 CUBE_LIST=6\nuint8 SPHERE_LIST=7\nuint8 POINTS=8\n"
      "uint8 TEXT_VIEW_FACING=9\nuint8 MESH_RESOURCE=10\nuint8 TRIANGLE_LIST=11\n"
      "uint8 ADD=0\nuint8 MODIFY=0\nuint8 DELETE=2\nuint8 DELETEALL=3\n"};
  /// Of those that ROS has, the ones that are sent.
  enum Type : std::int32_t {
    kArrow = 0,
    kCube = 1,
    kSphere = 2,
    kCylinder = 3,
    kLineStrip = 4,
    kPoints = 8,
    kText = 9
  };
  /// kAdd also replaces what has the same ns and id.
  enum Action : std::int32_t { kAdd = 0, kDelete = 2, kDeleteAll = 3 };
  Header header;   ///< Of `pose` and `points`.
  std::string ns;  ///< Namespace: RViz shows and hides it as one.
  /// Number within the namespace; `Type`; `Action`.
  ///@{
  std::int32_t id = 0, type = 0, action = 0;
  ///@}
  Pose pose;        ///< Of the shape's own frame in the header's.
  Vector3 scale;    ///< Whole sides or diameters, m; of lines x is the width, of text z the height.
  ColorRGBA color;  ///< Of all that `colors` does not say.
  Duration lifetime;                         ///< After the last message; zero: for ever.
  bool frame_locked = false;                 ///< RViz moves it along with its frame.
  std::vector<Point> points;                 ///< Of lines, points and arrows, m.
  std::vector<ColorRGBA> colors;             ///< One per point, or none.
  std::string texture_resource;              ///< ROS 2 only, as the next two.
  CompressedImage texture;                   ///< Empty here.
  std::vector<UVCoordinate> uv_coordinates;  ///< Empty here.
  /// What a kText says; address of a mesh, empty here.
  ///@{
  std::string text, mesh_resource;
  ///@}
  MeshFile mesh_file;                        ///< ROS 2 only.
  bool mesh_use_embedded_materials = false;  ///< Of no use without a mesh.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("ns", m.ns);
    v("id", m.id);
    v("type", m.type);
    v("action", m.action);
    v("pose", m.pose);
    v("scale", m.scale);
    v("color", m.color);
    v("lifetime", m.lifetime);
    v("frame_locked", m.frame_locked);
    v("points", m.points);
    v("colors", m.colors);
    if constexpr (V::kRos == 2) {
      v("texture_resource", m.texture_resource);
      v("texture", m.texture);
      v("uv_coordinates", m.uv_coordinates);
    }
    v("text", m.text);
    v("mesh_resource", m.mesh_resource);
    if constexpr (V::kRos == 2) v("mesh_file", m.mesh_file);
    v("mesh_use_embedded_materials", m.mesh_use_embedded_materials);
  }
};

/// Markers that arrive together.
struct MarkerArray {
  static constexpr TypeName kType{"visualization_msgs", "MarkerArray"};
  std::vector<Marker> markers;  ///< Each has a header of its own.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("markers", m.markers);
  }
};

/// One figure of a status.
struct KeyValue {
  static constexpr TypeName kType{"diagnostic_msgs", "KeyValue"};
  /// Both are text, whatever the figure is.
  ///@{
  std::string key, value;
  ///@}
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("key", m.key);
    v("value", m.value);
  }
};

/// ROS type `byte`: an octet that is no number.
enum class Octet : std::uint8_t {};

/// How something is: one for each vehicle.
struct DiagnosticStatus {
  static constexpr TypeName kType{"diagnostic_msgs",
                                  "DiagnosticStatus",
                                  "diagnostic_msgs",
                                  "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n"};
  Octet level{};  ///< 0 fine, 1 warning (in contact), 2 error (crashed), 3 stale (never sent).
  /// "pointflight: " and the vehicle's name; one line; the vehicle's model.
  ///@{
  std::string name, message, hardware_id;
  ///@}
  std::vector<KeyValue> values;  ///< Clearance, collisions, rejected commands, ...
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("level", m.level);
    v("name", m.name);
    v("message", m.message);
    v("hardware_id", m.hardware_id);
    v("values", m.values);
  }
};

/// All vehicles' states, for rqt_robot_monitor and the like.
struct DiagnosticArray {
  static constexpr TypeName kType{"diagnostic_msgs", "DiagnosticArray"};
  Header header;                         ///< Its frame says nothing.
  std::vector<DiagnosticStatus> status;  ///< By number of the vehicle.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("header", m.header);
    v("status", m.status);
  }
};

}  // namespace pointflight::msg
