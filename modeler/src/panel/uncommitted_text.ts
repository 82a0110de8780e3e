/** Watch the fields below an element, and return a function that says whether one has text that is not committed. */
export function watchUncommittedText(element: HTMLElement): () => boolean {
  let typing = false;
  element.addEventListener('input', () => (typing = true), true);
  for (const ended of ['change', 'focusout']) {
    element.addEventListener(ended, () => (typing = false), true); // before what the text is committed to
  }
  return () => typing && element.contains(document.activeElement);
}
