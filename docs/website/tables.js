// Tables that are wider than the screen are reached by keys, which scroll them.
function reach() {
  for (const table of document.querySelectorAll('.md-typeset__table')) {
    if (table.scrollWidth > table.clientWidth) table.tabIndex = 0;
    else table.removeAttribute('tabindex');
  }
}
addEventListener('load', reach);
addEventListener('resize', reach);
