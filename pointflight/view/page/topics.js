// The topics of a recording, each with a box that shows or hides what it draws.
const make = (tag, properties) => Object.assign(document.createElement(tag), properties);

function rowOf(topic, recording) {
  const box = make("input", { type: "checkbox", checked: topic.isDrawn && topic.isOn, disabled: !topic.isDrawn });
  box.onchange = () => recording.show(topic, box.checked);
  const row = make("label", { title: topic.isDrawn ? topic.kind : `${topic.kind || topic.channel.encoding}: not drawn` });
  row.append(make("span", { textContent: topic.channel.topic }), box);
  if (!topic.isDrawn) row.className = "off";
  return row;
}

export function showTopics(place, recording) {
  place.replaceChildren(make("h1", { textContent: "topics" }), ...recording.topics.map((topic) => rowOf(topic, recording)));
}
