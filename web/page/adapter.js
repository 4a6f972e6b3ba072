// The adapter that the browser offers, and what is to be said where it offers none. For the page and its worker.

export async function requestAdapter() {
  return navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
}

// Why nothing can be measured here, or an empty text.
export async function adapterTrouble() {
  if (!globalThis.isSecureContext) return "WebGPU works only on pages from https:// or localhost: open this one so.";
  if (!navigator.gpu) {
    return "This browser has no WebGPU. Chrome and Edge from 113, Safari from 26 and Firefox from 141 (Windows) have it.";
  }
  try {
    const adapter = await requestAdapter();
    if (!adapter) return "This browser has WebGPU, but offers no adapter: its list of GPUs may block this one, or hardware acceleration is off.";
  } catch (error) {
    return `The browser refuses an adapter: ${error.message}`;
  }
  return "";
}

// All that the browser says of it, for records: vendor, architecture, device, description.
export async function adapterName() {
  const { info } = (await requestAdapter()) ?? {};
  if (!info) return "";
  const parts = [info.vendor, info.architecture, info.device, info.description];
  const fallback = info.isFallbackAdapter && !/swiftshader|llvmpipe|basic render/i.test(parts.join(" "));
  return [...new Set(parts), fallback ? "(fallback)" : ""].filter(Boolean).join(" ");
}
