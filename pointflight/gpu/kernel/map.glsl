// A map in a device's memory: the sections of its file, one buffer each, or, with SPLIT, several with
// a power of two of items in each, where a section is larger than a buffer may be.

layout(std430, set = 0, binding = 0) restrict readonly buffer Map { MapNumbers map; };
layout(std430, set = 0, binding = 1) restrict readonly buffer Nodes { uvec4 nodes[]; };
layout(std430, set = 0, binding = 2) restrict readonly buffer Words { uvec2 words[]; };

#if SPLIT
layout(std430, set = 0, binding = 11) restrict readonly buffer Nodes1 { uvec4 nodes1[]; };
layout(std430, set = 0, binding = 12) restrict readonly buffer Nodes2 { uvec4 nodes2[]; };
layout(std430, set = 0, binding = 13) restrict readonly buffer Nodes3 { uvec4 nodes3[]; };
layout(std430, set = 0, binding = 14) restrict readonly buffer Words1 { uvec2 words1[]; };
layout(std430, set = 0, binding = 15) restrict readonly buffer Words2 { uvec2 words2[]; };
layout(std430, set = 0, binding = 16) restrict readonly buffer Words3 { uvec2 words3[]; };
layout(std430, set = 0, binding = 17) restrict readonly buffer Words4 { uvec2 words4[]; };
layout(std430, set = 0, binding = 18) restrict readonly buffer Words5 { uvec2 words5[]; };
layout(std430, set = 0, binding = 19) restrict readonly buffer Words6 { uvec2 words6[]; };
layout(std430, set = 0, binding = 20) restrict readonly buffer Words7 { uvec2 words7[]; };

/// A quarter of the first words of a node, and so on: five to a node.
uvec4 node_at(uint i) {
  uint at = i & ((1u << map.node_shift) - 1u);
  uint part = i >> map.node_shift;
  if (part == 0u) return nodes[at];
  if (part == 1u) return nodes1[at];
  return part == 2u ? nodes2[at] : nodes3[at];
}

uvec2 word_at(uint i) {
  uint at = i & ((1u << map.word_shift) - 1u);
  uint part = i >> map.word_shift;
  if (part < 4u) {
    if (part < 2u) return part == 0u ? words[at] : words1[at];
    return part == 2u ? words2[at] : words3[at];
  }
  if (part < 6u) return part == 4u ? words4[at] : words5[at];
  return part == 6u ? words6[at] : words7[at];
}
#else
uvec4 node_at(uint i) { return nodes[i]; }
uvec2 word_at(uint i) { return words[i]; }
#endif
