// What somebody may write into a field so that a page does more than show it. Each would leave `pwned` behind: an
// element or an attribute of that name, a dialog, a request. Short enough for a name (80 letters), no spaces around.

/** Each a text of one line. @type {string[]} */
export const LINES = [
  // Tags.
  "<script>alert('pwned')</script>",
  "<ScRiPt>alert('pwned')</sCrIpT>",
  "<script src=//127.0.0.1:9/pwned.js></script>",
  "<scr<script>ipt>alert('pwned')</scr</script>ipt>",
  "</script><script>alert('pwned')</script>",
  "<script/x>alert('pwned')</script/x>",
  "<pwned-element></pwned-element>",
  "<b data-pwned=1>bold</b>",
  "<iframe data-pwned src=javascript:alert('pwned')></iframe>",
  "<iframe data-pwned srcdoc='<script>alert(1)</script>'>",
  "<object data-pwned data=javascript:alert('pwned')>",
  "<embed data-pwned src=javascript:alert('pwned')>",
  "<form data-pwned action=//127.0.0.1:9><input name=inspector>",
  "<base data-pwned href=//127.0.0.1:9/>",
  "<meta data-pwned http-equiv=refresh content=0;url=//127.0.0.1:9>",
  "<link data-pwned rel=stylesheet href=//127.0.0.1:9/pwned.css>",
  "<style data-pwned>*{display:none}</style>",
  "<template data-pwned><script>alert(1)</script></template>",
  "<noscript><p data-pwned title='</noscript><img src=x onerror=alert(1)>'>",
  "<plaintext data-pwned>",
  "<textarea data-pwned>",
  "</textarea><i data-pwned>x</i>",
  "</title><i data-pwned>x</i>",
  "</option></select><i data-pwned>x</i>",
  "</td></tr></table><i data-pwned>x</i>",
  "</style><i data-pwned>x</i>",
  "<!-- <i data-pwned>",
  "--><i data-pwned>x</i>",
  "<![CDATA[<i data-pwned>x</i>]]>",
  "<?pwned x?>",
  "<dialog data-pwned open>x</dialog>",
  // Handlers of events.
  "<img data-pwned src=x onerror=alert('pwned')>",
  "<img data-pwned src=x:x onerror=alert`pwned`//",
  "<body data-pwned onload=alert('pwned')>",
  "<input data-pwned autofocus onfocus=alert('pwned')>",
  "<details data-pwned open ontoggle=alert('pwned')>",
  "<video data-pwned><source onerror=alert('pwned')></video>",
  "<audio data-pwned src=x onerror=alert('pwned')>",
  "<marquee data-pwned onstart=alert('pwned')>x</marquee>",
  "<div data-pwned style=animation-name:x onanimationstart=alert(1)>",
  "<a data-pwned href=javascript:alert('pwned')>here</a>",
  // Out of an attribute.
  '" data-pwned="1',
  "' data-pwned='1",
  "\" autofocus onfocus=alert('pwned') data-pwned=\"",
  '"><i data-pwned>x</i>',
  "x' onmouseover='alert(1)' data-pwned='",
  "` onmouseover=alert(1) data-pwned=`",
  'x" style="background:url(//127.0.0.1:9/pwned)',
  // Pictures that are programs.
  "<svg data-pwned onload=alert('pwned')>",
  "<svg data-pwned><script>alert('pwned')</script></svg>",
  "<svg><animate data-pwned onbegin=alert(1) attributeName=x dur=1s>",
  "<svg><foreignObject data-pwned><body onload=alert(1)>",
  "<math data-pwned href=javascript:alert(1)><mi>x</mi></math>",
  // Addresses.
  "javascript:alert('pwned')",
  "JaVaScRiPt:alert('pwned')",
  "data:text/html,<script>alert('pwned')</script>",
  "vbscript:msgbox('pwned')",
  "#/sessions/../../pwned",
  "../../../etc/pwned",
  "%3Cscript%3Ealert('pwned')%3C/script%3E",
  // Other languages' templates, and ours.
  "${alert('pwned')}",
  "{{constructor.constructor('alert(1)')()}} pwned",
  "{name} {age} {n} pwned",
  "<%= pwned %>",
  "#{pwned} *{pwned} @{pwned}",
  "$& $1 $` $' pwned",
  "__proto__ pwned",
  "constructor pwned",
  // What a page might decode once too often.
  "&lt;script&gt;alert('pwned')&lt;/script&gt;",
  "&#60;script&#62;alert('pwned')&#60;/script&#62;",
  "&quot; onfocus=&quot;alert(1) pwned",
  "\\u003cscript\\u003ealert('pwned')\\u003c/script\\u003e",
  "\\x3cscript\\x3ealert('pwned')",
  // Quotes.
  "\"'`\\\"\\' pwned",
  "'; drop table inspectors; -- pwned",
  '" or ""=" pwned',
  // Letters that are not seen, or turn the line around.
  "\u202egnp.denwp",
  "pwned\u200b\u200c\u200d\ufeffzero width",
  "\u2066pwned\u2067isolated\u2069",
  "pwned e\u0301\u0302\u0303\u0304\u0305\u0306\u0307\u0308 marks",
  "pwned 👩‍🚀🇨🇳 𠀋",
  "عربي pwned עברית",
  "＜script＞alert('pwned')＜/script＞",
  // What a spreadsheet reckons.
  '=HYPERLINK("http://127.0.0.1:9/pwned")',
  "=1+1 pwned",
  "+1+1 pwned",
  "-1+1 pwned",
  "@SUM(1+1) pwned",
  "=cmd|' /C pwned'!A0",
  "a,b;c pwned",
  // As long as a name may be.
  `${"W".repeat(74)} pwned`,
];

/** Texts of several lines, and longer than a name. @type {string[]} */
export const BLOCKS = [
  "pwned\r\nSet-Cookie: pwned=1\r\n\r\n<script>alert(1)</script>",
  "pwned\n<i data-pwned>x</i>\n\n\tend",
  "<i data-pwned>".repeat(120),
  "pwned ".repeat(300).trim(),
];

/** What no name may hold. @type {string[]} */
export const CONTROLS = [
  "pwned\r\nSet-Cookie: pwned=1",
  "pwned\u0000end",
  "pwned\u001b[31mred",
  "pwned\ttab",
  "pwned\u0085next",
];

/**
 * Texts put together, so that few fields hold them all.
 * @param {string[]} texts
 * @param {number} letters in one field at the most
 * @returns {string[][]} what each field holds
 */
export function together(texts, letters) {
  /** @type {string[][]} */
  const fields = [];
  let length = Infinity;
  for (const text of texts) {
    const more = [...text].length + 3;
    if (length + more > letters) {
      fields.push([]);
      length = 0;
    }
    fields[fields.length - 1].push(text);
    length += more;
  }
  return fields;
}
/** What stands between them. */
export const BETWEEN = " ¦ ";
