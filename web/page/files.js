// Files and folders of the visitor, by dialog or dropped on the page. They stay in the browser.

// What the page holds at most, bytes.
const MOST = 1 << 30;

// A folder's files have their path in it, others their name.
const named = (file) => ({ name: file.webkitRelativePath || file.name, file });

async function below(entry) {
  if (entry.isFile) {
    const file = await new Promise((take, fail) => entry.file(take, fail));
    return [{ name: entry.fullPath.replace(/^\//, ""), file }];
  }
  const reader = entry.createReader();
  const found = [];
  // A reader gives a hundred at a time.
  for (;;) {
    const some = await new Promise((take, fail) => reader.readEntries(take, fail));
    if (some.length === 0) break;
    for (const one of some) found.push(...(await below(one)));
  }
  return found;
}

async function dropped(transfer) {
  // Entries are known only until the event ends.
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  const files = [...transfer.files];
  if (!entries.some(({ isDirectory }) => isDirectory)) return files.map(named);
  return (await Promise.all(entries.map(below))).flat();
}

async function contents(files) {
  const bytes = files.reduce((sum, { file }) => sum + file.size, 0);
  if (bytes > MOST) throw new Error(`these files have ${(bytes / 2 ** 30).toFixed(1)} GiB, and the page holds 1 GiB: open fewer at a time`);
  return Promise.all(files.map(({ file }) => file.arrayBuffer()));
}

// `take` is given the names and the contents; `fail` a sentence.
export function visitorsFiles({ file, folder, openFile, openFolder }, take, fail) {
  const read = async (found) => {
    try {
      const files = await found;
      if (files.length === 0) return;
      take(files.map(({ name }) => name), await contents(files));
    } catch (error) {
      fail(`The files cannot be opened: ${error.message}.`);
    }
  };
  for (const [button, input] of [[openFile, file], [openFolder, folder]]) {
    button.onclick = () => input.click();
    input.onchange = () => {
      const files = [...input.files].map(named);
      // The same again is a choice, too.
      input.value = "";
      read(files);
    };
  }
  const has = ({ dataTransfer }) => dataTransfer?.types.includes("Files");
  const mark = (is) => document.body.classList.toggle("dropping", is);
  addEventListener("dragover", (event) => {
    if (!has(event)) return;
    event.preventDefault();
    mark(true);
  });
  addEventListener("dragleave", (event) => event.relatedTarget || mark(false));
  addEventListener("drop", (event) => {
    if (!has(event)) return;
    event.preventDefault();
    mark(false);
    read(dropped(event.dataTransfer));
  });
}
