# Every message has these two members; Doxygen gets their documentation from here.
s|^  static constexpr TypeName kType|  /** Package and name in both ROSes, with the constants of the definition. */ &|
s|^  template <class M, class V>|  /** The table of fields: calls `v(name, field)` for each, in the order of the wire of ROS `V::kRos`. */ &|
