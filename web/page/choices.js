// A choice for each axis of an experiment, with the parameters that its entries declare; and the settings that they stand for.

const TITLES = { scene: "Scene", accel: "Structure", sequence: "Sequence", decorrelation: "Decorrelation", integrator: "Integrator", organisation: "Organisation" };

// How the parameters of a field are drawn, by its id.
const drawn = new Map();

const idOf = (axis, side) => (side ? `${axis}-${side}` : axis);

function element(name, attributes = {}, ...children) {
  const made = Object.assign(document.createElement(name), attributes);
  made.append(...children);
  return made;
}

// The field of an axis; `changed` is called when something else is chosen; `model` is what any file has that is not among the entries.
export function axisField(axis, side, { entries, first }, changed, model = {}) {
  const id = idOf(axis, side);
  const options = entries.map(({ name, description }) => element("option", { value: name, textContent: name, title: description }));
  const select = element("select", { id }, ...options);
  select.value = first;
  const details = element("details", { className: "parameters" });
  const draw = () => {
    const entry = entries.find(({ name }) => name === select.value) ?? { description: "", parameters: [], ...model, name: select.value };
    select.title = entry.description;
    details.hidden = entry.parameters.length === 0;
    const fields = entry.parameters.map((parameter) => parameterField(id, parameter, changed));
    details.replaceChildren(element("summary", { textContent: `Parameters of ${entry.name}` }), ...fields);
  };
  select.onchange = () => {
    draw();
    changed();
  };
  drawn.set(id, draw);
  draw();
  return element("div", { className: "axis" }, element("label", { htmlFor: id, textContent: TITLES[axis] }), select, details);
}

function parameterField(axis, { name, description, default: initial, range }, changed) {
  const id = `${axis}-${name}`;
  let input;
  if (range.names) {
    input = element("select", { id }, ...range.names.map((value) => element("option", { value, textContent: value })));
    input.value = initial;
  } else if (typeof initial === "boolean") {
    input = element("input", { id, type: "checkbox", checked: initial });
  } else if (range.text) {
    input = element("input", { id, type: "text", required: range.text === "filled", autocomplete: "off", spellcheck: false, value: initial });
  } else {
    input = element("input", { id, type: "number", required: true, min: range.min, max: range.max, step: range.step, value: initial });
  }
  input.title = description;
  input.dataset.parameter = name;
  input.dataset.initial = String(initial);
  input.onchange = () => (input.reportValidity() ? changed() : undefined);
  return element("div", {}, element("label", { htmlFor: id, textContent: name.replaceAll("_", " ") }), input);
}

// Chooses what is on screen, without asking for it.
export function adopt(axis, side, { name, params }) {
  const id = idOf(axis, side);
  const select = document.getElementById(id);
  offer(select, name);
  select.value = name;
  drawn.get(id)();
  for (const input of select.parentElement.querySelectorAll("[data-parameter]")) {
    const value = params[input.dataset.parameter];
    if (input.type === "checkbox") input.checked = value;
    else if (value !== undefined) input.value = value;
  }
}

// Makes sure that a list has a value.
export function offer(select, value, text = value) {
  if (![...select.options].some((option) => option.value === value)) select.append(element("option", { value, textContent: text }));
}

// Lists the models of the visitor in place of those of before.
export function listModels(names) {
  const select = document.getElementById(idOf("scene", ""));
  select.querySelector("optgroup")?.remove();
  if (names.length === 0) return;
  const options = names.map((name) => element("option", { value: name, textContent: name }));
  select.prepend(element("optgroup", { label: "Opened here" }, ...options));
}

// What is chosen on an axis, as settings of an experiment; parameters at their defaults need none.
export function overridesOf(axis, side) {
  const select = document.getElementById(idOf(axis, side));
  const inputs = [...select.parentElement.querySelectorAll("[data-parameter]")];
  const value = (input) => {
    if (input.type === "checkbox") return String(input.checked);
    // As TOML writes it: `.5` is none of its numbers.
    return input.type === "number" ? String(input.valueAsNumber) : JSON.stringify(input.value);
  };
  const isChanged = (input) => String(input.type === "checkbox" ? input.checked : input.value) !== input.dataset.initial;
  const changed = inputs.filter((input) => isChanged(input) && input.checkValidity());
  // The name of a file has a point.
  const name = /^[\w-]+$/.test(select.value) ? select.value : JSON.stringify(select.value);
  return [
    `axes.${axis}=[${JSON.stringify(select.value)}]`,
    ...changed.map((input) => `${axis}.${name}.${input.dataset.parameter}=${value(input)}`),
  ];
}
