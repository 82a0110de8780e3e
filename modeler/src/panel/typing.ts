/** Watch for text that a person types below an element; the answer says whether some is not committed yet. */
export function watchTyping(element: HTMLElement): () => boolean {
  let typing = false;
  element.addEventListener('input', () => (typing = true), true);
  for (const ended of ['change', 'focusout']) {
    element.addEventListener(ended, () => (typing = false), true); // before what the text is committed to
  }
  return () => typing && element.contains(document.activeElement);
}
